"""Summary of a run: one dictionary, printed, written as ``summary.json``, and output by ``--json``."""

from __future__ import annotations

import json
import platform
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld import __version__
from warpjld.script.folder import OutputFolder
from warpjld.script.scene import Scene

__all__ = ["NAME", "Summary", "table"]

NAME = "summary.json"
"""File name of the summary in the output folder."""


@dataclass
class Summary:
    """Collects the summary while the outputs of a scene are made.

    Attributes:
        seconds: Wall time of each stage [s].
        press: Verdict of the contact simulation, if there was one.
        contacts: Contacts with objects, by frame.
        failed: Outputs that could not be made, with the error.
        notes: What was guessed, clamped to a limit, left out or looks suspicious.
    """

    scene: Scene
    frames: NDArray[np.float64]
    script: Path | None
    device: str
    seconds: dict[str, float] = field(default_factory=dict)
    contacts: list[dict[str, Any]] = field(default_factory=list)
    press: dict[str, Any] | None = None
    failed: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Context that adds to the time of a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = round(self.seconds.get(stage, 0.0) + time.perf_counter() - start, 3)

    def write(self, out: OutputFolder) -> dict[str, Any]:
        """Write ``summary.json`` beside the files made so far, and return its content."""
        made = [(name.as_posix(), (out.work / name).stat().st_size) for name in out.made()]
        content = self.content([{"name": name, "bytes": size} for name, size in made], out.path)
        out.place(NAME).write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        return content

    def content(self, files: Sequence[dict[str, Any]], folder: Path) -> dict[str, Any]:
        """The summary as JSON values."""
        return {
            "warpjld": __version__,
            "script": None if self.script is None else str(self.script),
            "folder": str(folder),
            "frames": {"first": int(self.frames[0]), "last": int(self.frames[-1]), "count": len(self.frames)},
            "rate": self.scene.rate,
            "device": self.device,
            "machine": platform.machine(),
            "actors": [
                {
                    "name": actor.name,
                    "rig": actor.rig.name,
                    "joints": len(actor.skeleton),
                    "vertices": len(actor.rig.surface.vertices),
                    "faces": len(actor.rig.surface.faces),
                    "keys": sum(len(track.frames) for track in actor.motion.tracks.values()),
                    "recorded": actor.recorded is not None,
                    "method": actor.method,
                    "domains": actor.domains,
                }
                for actor in self.scene.actors.values()
            ],
            "objects": [
                {
                    "name": prop.name,
                    "origin": prop.thing.origin,
                    "facets": len(prop.thing.faces),
                    "watertight": prop.thing.report.watertight,
                    "found": prop.thing.report.notes(),
                }
                for prop in self.scene.props.values()
            ],
            "searches": [attempt.content() for attempt in self.scene.attempts],
            "contacts": self.contacts,
            "press": self.press,
            "files": list(files),
            "seconds": self.seconds,
            "warnings": self.scene.warnings,
            "failed": self.failed,
            "notes": self.notes,
        }


def table(content: dict[str, Any], say: Callable[[str], None] = print) -> None:
    """Print a summary in readable form."""
    from rich.console import Console

    console = Console(highlight=False, markup=False, soft_wrap=True)
    frames = content["frames"]
    with console.capture() as lines:
        for thing in content.get("objects", []):
            console.print(f"{thing['name']}: {thing['origin']}, {thing['facets']:,} facets")
            for found in thing["found"]:
                console.print(f"  {found}")
        for search in content.get("searches", []):
            console.print(f"{search['command']} at {search['frame']:g}: {search['message']}")
        for row in content.get("contacts", []):
            console.print(f"frame {row['frame']:g}, {row['actor']} and {row['object']}: {row['message']}")
        if content.get("press"):
            press = content["press"]
            console.print(f"contact: {press['verdict']}")
            for line in [
                *(press["grips"] + press["digits"] + press["balance"]),
                *(press["stops"] + press["corrections"] + press["suggestions"]),
            ]:
                console.print(f"  {line}")
        for actor in content["actors"]:
            drive = "a motion file" if actor["recorded"] else f"{actor['keys']} keys"
            console.print(f"{actor['name']}: {actor['rig']}, {actor['vertices']:,} vertices, {drive}")
        spent = ", ".join(f"{stage} {value:.2f} s" for stage, value in content["seconds"].items())
        count = f"{frames['count']} frames ({frames['first']} to {frames['last']}) at {content['rate']:g}/s"
        console.print(f"{count}: {spent}" if spent else count)
        sizes = {f"{content['folder']}/{name}": size for name, size in _grouped(content["files"])}
        width = max(map(len, sizes), default=0)  # not a rich table, which would truncate paths wider than the terminal
        for path, size in sizes.items():
            console.print(f"{path:{width}}  {'to be made' if size is None else _readable(size)}")
        for note in content["notes"]:
            console.print(f"note: {note}")
    say(lines.get().rstrip())


def _grouped(files: list[dict[str, Any]]) -> list[tuple[str, float | None]]:
    """Files by name and size; the files of a sequence as one entry."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for file in files:
        groups.setdefault(re.sub(r"\d{4,}(?=\.\w+$)", "####", file["name"]), []).append(file)
    rows: list[tuple[str, float | None]] = []
    for pattern, members in groups.items():
        name = members[0]["name"] if len(members) == 1 else f"{pattern} ({len(members)} files)"
        made = all("bytes" in member for member in members)
        rows.append((name, sum(member["bytes"] for member in members) if made else None))
    return rows


def _readable(size: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "bytes" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} GB"
