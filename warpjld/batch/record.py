"""Records of finished clips: status, and hashes of inputs and outputs."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from warpjld.files.manifest import file_hash, write_json
from warpjld.io.identity import content_hash

__all__ = ["FOLDER", "ClipRecord", "read_record", "still_there", "write_record"]

FOLDER = ".clips"
"""Folder of the records, in the output folder."""


@dataclass(frozen=True)
class ClipRecord:
    """Result of a clip.

    Attributes:
        name: Name of the clip.
        motion: Path of the motion file, as given.
        motion_sha256: Its hash, see ``content_hash``; "" if it could not be read.
        animation: Name of the animation used, or None.
        status: ``done``, ``failed`` or ``crashed``.
        message: Reason of a failure.
        frames: Number of frames made.
        rate: Frames a second.
        files: Hashes of the files made, by name in the output folder.
        warnings: What of the motion the rig does not follow, and what looks wrong.
        notes: Further information for the user.
    """

    name: str
    motion: str
    motion_sha256: str
    animation: str | None
    status: str
    message: str = ""
    frames: int = 0
    rate: float = 0.0
    files: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def content(self) -> dict[str, Any]:
        """The record as plain values, for JSON."""
        return asdict(self)


def write_record(out: Path, record: ClipRecord) -> None:
    """Write a record to the output folder, atomically."""
    (out / FOLDER).mkdir(parents=True, exist_ok=True)
    write_json(out / FOLDER / f"{record.name}.json", record.content())


def read_record(out: Path, name: str) -> ClipRecord | None:
    """A clip's record; None if there is none that can be read."""
    try:
        return ClipRecord(**json.loads((out / FOLDER / f"{name}.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def still_there(out: Path, record: ClipRecord) -> bool:
    """Whether a clip is done, and its inputs and outputs are unchanged."""
    try:
        return (
            record.status == "done"
            and content_hash(Path(record.motion)) == record.motion_sha256
            and all(file_hash(out / name) == value for name, value in record.files.items())
        )
    except OSError:
        return False
