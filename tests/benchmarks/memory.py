"""The most memory that ``warpjld deform`` holds over long motions: every format read, and every format written.

    python -m tests.benchmarks.memory [--frames 100000] [--inputs m.bvh,…] [--motions npz,…] [--caches pc2,…]
                                      [--from m.bvh] [--keep FOLDER]

Motions of the built-in hand (25 joints) are read and written as MANO parameters, then one of them is written as a
motion in every format, and a finger of 338 vertices as a vertex cache. Rows have the resident set of the largest
process [MB, 10⁶ bytes] and the processor's time of all [s]: USD, FBX and meshes are read in a process of their own.
This program imports little, since a process inherits the largest resident set of the one that starts it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import click

_ROOT = Path(__file__).resolve().parents[2]
_INPUTS = (
    *("m.bvh", "m.csv", "m.glb", "m.vrma", "m.fbx", "m.usda", "m.usdc"),
    *("mano.npz", "mano.json", "points.npy", "points.json", "points.jsonl", "leap.json", "webxr.json"),
)
_MOTIONS = ("bvh", "glb", "usdc", "usda", "npz")
_CACHES = ("pc2", "mdd", "npz", "abc", "usdc", "usda", "obj")  # glb holds 300 frames
_MOST = 450.0  # MB that 100,000 frames may take


@click.command()
@click.option("--frames", default=100_000, show_default=True)
@click.option("--inputs", default=",".join(_INPUTS), help="Motions to read.")
@click.option("--motions", default=",".join(_MOTIONS), help="Formats to write a motion in.")
@click.option("--caches", default=",".join(_CACHES), help="Formats to write a surface in.")
@click.option("--from", "source", default="mano.npz", show_default=True, help="Motion that is written in all formats.")
@click.option("--keep", type=click.Path(path_type=Path), help="Folder for the inputs, which are not made again.")
def main(frames: int, inputs: str, motions: str, caches: str, source: str, keep: Path | None) -> None:
    """Print a table; exit code 1 where a process took more than 100,000 frames may take."""
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = (Path(name) if keep is None else keep).absolute()
        folder.mkdir(exist_ok=True)
        print(f"| {frames:,} frames of | read from | written to | MB | s |\n|---|---|---|---|---|", flush=True)
        for rig, motion, kind, option in _rows(inputs, motions, caches, source):
            for needed in (rig, motion):
                if not (folder / needed).is_file():
                    _run(["-m", "tests.benchmarks.memory_inputs", str(folder), str(frames), needed])
            with tempfile.TemporaryDirectory(dir=folder) as out:
                written = str(Path(out) / f"out.{kind}")
                done = _run(["-m", "warpjld", "deform", rig, "--motion", motion, option, written, "--quiet"], folder)
            worst = max(worst, done[0])
            what = "vertices" if option == "--out" else "joints"
            print(f"| {Path(rig).stem} | {motion} | {kind}, {what} | {done[0]:.0f} | {done[1]:.0f} |", flush=True)
    sys.exit(int(worst > _MOST))


def _rows(inputs: str, motions: str, caches: str, source: str) -> Iterator[tuple[str, str, str, str]]:
    """Rig, motion, format and option of every command."""
    for motion in filter(None, inputs.split(",")):
        yield "hand.glb", motion, "npz", "--motion-out"
    for kind in filter(None, motions.split(",")):
        yield "hand.glb", source, kind, "--motion-out"
    for kind in filter(None, caches.split(",")):
        yield "finger.glb", "finger.glb", kind, "--out"


def _run(arguments: list[str], folder: Path = _ROOT) -> tuple[float, float]:
    """Run Python; the largest resident set of it and the processes that it waited for [MB], and their time [s]."""
    paths = os.pathsep.join([str(_ROOT), str(_ROOT / "kernels"), *sys.path])
    environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen([sys.executable, *arguments], cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"ended with code {process.returncode}: {' '.join(arguments)}")
    return used.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e6, used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
