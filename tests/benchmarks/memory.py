"""The most memory that ``warpjld deform`` holds over long motions: every format read, by every format written.

    python -m tests.benchmarks.memory [--frames 100000] [--inputs m.bvh,…] [--outputs pc2,…] [--every] [--keep FOLDER]

The rig is the built-in hand of 1,452 vertices, written as GLB. Unless every pair is asked for, each input is
written as a point cache and as a motion, and one input, BVH, in every format. A cell has the resident set of the
largest process [MB, 10⁶ bytes] and the processor's time of all [s]: USD, FBX and meshes are read in a process of
their own. This program imports little, since a process inherits the largest resident set of the one that starts it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import click

_ROOT = Path(__file__).resolve().parents[2]
_INPUTS = (
    *("m.bvh", "m.csv", "m.glb", "m.vrma", "m.fbx", "m.usda", "m.usdc"),
    *("mano.npz", "mano.json", "points.npy", "points.json", "points.jsonl", "leap.json", "webxr.json"),
)
_CACHES = ("pc2", "mdd", "npz", "abc", "usdc", "usda", "obj")
_MOTIONS = ("motion.bvh", "motion.glb", "motion.usdc", "motion.usda", "motion.npz")
_FIRST, _FEW = "m.bvh", ("pc2", "motion.npz")
_MOST = 450.0  # MB that 100,000 frames may take


@click.command()
@click.option("--frames", default=100_000, show_default=True)
@click.option("--inputs", default=",".join(_INPUTS), help="Files to read.")
@click.option("--outputs", default=",".join((*_CACHES, *_MOTIONS)), help="Formats to write.")
@click.option("--every", is_flag=True, help="Every input in every format.")
@click.option("--keep", type=click.Path(path_type=Path), help="Folder for the inputs, which are not made again.")
def main(frames: int, inputs: str, outputs: str, every: bool, keep: Path | None) -> None:
    """Print a table of megabytes and seconds; exit code 1 where one is above what 100,000 frames may take."""
    read, written = inputs.split(","), outputs.split(",")
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) if keep is None else keep
        folder.mkdir(exist_ok=True)
        print(f"| {frames:,} frames | {' | '.join(written)} |\n|{'---|' * (len(written) + 1)}", flush=True)
        for one in read:
            if not (folder / one).is_file():
                _run(["-m", "tests.benchmarks.memory_inputs", str(folder), str(frames), one])
            print(f"| {one} |", end="", flush=True)
            for kind in written:
                cell = ""
                if every or one == _FIRST or kind in _FEW or len(written) == 1:
                    megabytes, seconds = _measured(folder, one, kind)
                    worst = max(worst, megabytes)
                    cell = f"{megabytes:.0f} MB, {seconds:.0f} s"
                print(f" {cell} |", end="", flush=True)
            print(flush=True)
    sys.exit(int(worst > _MOST))


def _measured(folder: Path, motion: str, kind: str) -> tuple[float, float]:
    with tempfile.TemporaryDirectory(dir=folder) as out:
        option = "--motion-out" if kind in _MOTIONS else "--out"
        name = kind if kind in _MOTIONS else f"cache.{kind}"
        arguments = ["hand.glb", "--motion", motion, option, str(Path(out) / name), "--quiet"]
        return _run(["-m", "warpjld", "deform", *arguments], folder)


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
