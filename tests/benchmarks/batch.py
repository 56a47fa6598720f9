"""A batch of clips beside one process a clip: frames a second, memory over time, and a batch killed and resumed.

    python tests/benchmarks/batch.py [--clips 50] [--frames 120] [--sample 6] [--processes 2] [--rig FILE]

The clips are pieces of the CMU walk in ``shared/data``, each beginning later and turned further about the vertical; the
rig is the Anny body there. Memory is the resident set of the command and of its workers, five times a second. A clip
counts where its file first stands; frames a second include starting, reading and binding the rig.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

_ROOT = Path(__file__).resolve().parents[2]
_DATA = _ROOT.parent / "shared" / "data"
_WALK = _DATA / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh"
_BODY = _DATA / "body_anny" / "body_104joints.glb"


@dataclass
class Run:
    """How a command went."""

    seconds: float
    code: int
    parent: list[tuple[int, float]] = field(default_factory=list)  # clips done, resident MiB
    workers: list[tuple[int, float]] = field(default_factory=list)  # clips done, resident MiB of all workers


@click.command()
@click.option("--clips", default=50, show_default=True)
@click.option("--frames", default=120, show_default=True, help="Frames of a clip.")
@click.option("--sample", default=6, show_default=True, help="Clips made one process each; their time is scaled.")
@click.option("--processes", default=2, show_default=True)
@click.option("--rig", type=click.Path(path_type=Path), default=_BODY, help="Another rig.")
def main(clips: int, frames: int, sample: int, processes: int, rig: Path) -> None:
    """Print the figures as tables."""
    for needed in (_WALK, rig):
        if not needed.is_file():
            sys.exit(f"skipped: {needed} is not there")
    console = Console()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = _cut(folder / "clips", clips, frames)
        whole = _batch(rig, files, folder / "whole", processes)
        singles = sum(
            _run([str(rig), str(file), "-o", str(folder / f"{file.stem}.pc2")], folder).seconds
            for file in files[:sample]
        )
        single = singles / min(sample, clips) * clips
        table = Table(title=f"{clips} clips of {frames} frames, {processes} processes")
        for heading in ("", "seconds", "frames a second"):
            table.add_column(heading)
        table.add_row("batch", f"{whole.seconds:.1f}", f"{clips * frames / whole.seconds:.0f}")
        table.add_row(f"one process a clip (from {sample})", f"{single:.1f}", f"{clips * frames / single:.0f}")
        console.print(table)
        _memory(console, whole, clips)
        _killed(console, rig, files, folder, processes)


def _cut(folder: Path, clips: int, frames: int) -> list[Path]:
    """Pieces of the walk, no two alike."""
    folder.mkdir()
    head, _, motion = _WALK.read_text().partition("MOTION")
    _, seconds, *rows = [line for line in motion.splitlines() if line.strip()]
    numbers = [[float(word) for word in row.split()] for row in rows]
    files = []
    for clip in range(clips):
        piece = []
        for frame in range(frames):
            row = list(numbers[(7 * clip + frame) % len(numbers)])
            row[0] += 10.0 * clip  # Xposition of the root
            piece.append(" ".join(f"{value:g}" for value in row))
        files.append(folder / f"walk{clip:02d}.bvh")
        files[-1].write_text(f"{head}MOTION\nFrames: {frames}\n{seconds}\n" + "\n".join(piece) + "\n")
    return files


def _batch(rig: Path, files: list[Path], out: Path, processes: int, *, kill_after: int | None = None) -> Run:
    arguments = [str(rig), *map(str, files), "-o", str(out), "--format", "pc2", "--processes", str(processes)]
    return _run(arguments, out, kill_after=kill_after)


def _run(arguments: list[str], out: Path, *, kill_after: int | None = None) -> Run:
    """Run ``warpjld deform``; killed when that many clips are done."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}
    began = time.perf_counter()
    command = [sys.executable, "-m", "warpjld", "deform", *arguments, "-q"]
    process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    run = Run(0.0, 0)
    while process.poll() is None:
        done = len(list((out / ".clips").glob("[!.]*.json"))) if out.is_dir() else 0
        run.parent.append((done, _resident(process.pid)))
        run.workers.append((done, sum(map(_resident, _children(process.pid)))))
        if kill_after is not None and done >= kill_after:
            process.send_signal(signal.SIGKILL)
            break
        time.sleep(0.2)
    run.code = process.wait()
    run.seconds = time.perf_counter() - began
    if kill_after is None and run.code:
        sys.exit(f"the command ended with code {run.code}: {' '.join(command)}")
    return run


def _memory(console: Console, run: Run, clips: int) -> None:
    table = Table(title="resident memory, MiB, highest while that many clips were done")
    for heading in ("clips done", "command", "workers together"):
        table.add_column(heading)
    marks = sorted({min(10, clips // 2), clips // 2, clips - 1})
    for mark in marks:
        near = [(a[1], b[1]) for a, b in zip(run.parent, run.workers, strict=True) if abs(a[0] - mark) <= 1]
        if near:
            table.add_row(str(mark), f"{max(a for a, _ in near):.0f}", f"{max(b for _, b in near):.0f}")
    table.add_row("peak", f"{max(m for _, m in run.parent):.0f}", f"{max(m for _, m in run.workers):.0f}")
    console.print(table)


def _killed(console: Console, rig: Path, files: list[Path], folder: Path, processes: int) -> None:
    """Kill a batch half-way, resume it, and compare with the whole one."""
    killed = folder / "killed"
    _batch(rig, files, killed, processes, kill_after=len(files) // 2)
    time.sleep(1.5)  # workers notice that they are orphans
    left = len(list((killed / ".clips").glob("[!.]*.json")))
    resumed = _batch(rig, files, killed, processes)
    hashes = [
        {clip["name"]: clip["files"] for clip in json.loads((out / "manifest.json").read_text())["clips"]}
        for out in (folder / "whole", killed)
    ]
    names = [{path.name for path in out.iterdir()} for out in (folder / "whole", killed)]
    same = hashes[0] == hashes[1] and names[0] == names[1]
    console.print(
        f"killed with {left} of {len(files)} clips done, resumed in {resumed.seconds:.1f} s: "
        f"{'the same bytes' if same else 'OTHER BYTES'}"
    )
    if not same:
        sys.exit(1)


def _resident(pid: int) -> float:
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("VmRSS")), 0.0)


def _children(pid: int) -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


if __name__ == "__main__":
    main()
