"""Scenes with contact of hands, this checkout beside another: seconds, and linear solves a load step.

    PYTHONPATH=.:kernels python tests/benchmarks/contact_scenes.py [--against OTHER] [--scenes press_plate …]
        [--every 5]

Each scene of ``examples/`` runs without its pictures, each checkout in turn, in a process and with a cache of its own:
first with nothing kept (``cold``), then again with the meshes of flesh that the first run kept (``warm``). Kernels are
compiled beforehand where they have run once. Given are processor seconds of all threads and seconds on the wall, of the
whole process and of contact alone (from the program's own line); linear solves of each load step that converged: the
median and the 90th percentile. Compare within one run only.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SCENES = ("press_plate", "press_fist", "press_ball")
PICTURES = ("CAMERA", "FILM", "PICTURE", "TACTILE")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="root of another checkout")
    parser.add_argument("--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("--every", type=int, help="solve every so many frames only")
    parser.add_argument("--one", nargs=2, metavar=("SCENE", "FOLDER"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        _one(*arguments.one)
        return
    trees = {"this": ROOT} | ({"other": arguments.against.resolve()} if arguments.against else {})
    heads = f"{'processor':>10}{'wall':>8}{'contact':>9}{'steps':>7}{'solves: median':>16}{'90 %':>6}"
    print(f"{'scene':28}{heads}")
    for scene in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            for state in ("cold", "warm"):
                for name, tree in trees.items():
                    place = Path(folder) / name
                    place.mkdir(exist_ok=True)
                    script = place / f"{scene}.jld"
                    script.write_text(_bare((ROOT / "examples" / f"{scene}.jld").read_text(), arguments.every))
                    print(f"{scene:14}{name:8}{state:6}{_measured(tree, script, place)}", flush=True)


def _bare(text: str, every: int | None) -> str:
    """A script without its pictures."""
    lines = [line for line in text.splitlines() if not line.startswith(PICTURES)]
    if every:
        lines = [re.sub(r"^(PRESS \d+ \d+)( EVERY \d+)?", rf"\1 EVERY {every}", line) for line in lines]
    return "\n".join(lines) + "\n"


def _measured(tree: Path, script: Path, place: Path) -> str:
    paths = os.pathsep.join([str(tree), str(tree / "kernels")])
    settings = {"PYTHONPATH": paths, "WARPJLD_CACHE": str(place / "cache"), "OMP_NUM_THREADS": "1"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, __file__, "--one", str(script), str(place / "out")]
    done = subprocess.run(command, env={**os.environ, **settings}, capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode != 0:
        return f"failed: {done.stderr.strip().splitlines()[-1:]}"
    contact = re.search(r"contact ([\d.]+) s", done.stdout)
    steps = json.loads(done.stdout.strip().splitlines()[-1])
    most = [float(np.percentile(steps, share)) for share in (50, 90)] if steps else [np.nan, np.nan]
    seconds = float(contact[1]) if contact else np.nan
    return f"{processor:10.1f}{wall:8.1f}{seconds:9.1f}{len(steps):7}{most[0]:16.1f}{most[1]:6.1f}"


def _one(scene: str, folder: str) -> None:
    """Run a scene in this process; its last line are the linear solves of the steps that converged, none for a checkout
    whose solver has other names."""
    from warpjld.cli import main as program

    steps: list[int] = []
    with contextlib.suppress(ImportError):
        _count_into(steps)
    sys.argv = ["warpjld", "run", scene, "-o", folder]
    try:
        program()
    finally:
        print(json.dumps(steps))


def _count_into(steps: list[int]) -> None:
    """Append the linear solves of every load step that converges from now on."""
    from warpjld.fem.contact.solver.contact_newton import ContactNewton

    find = ContactNewton.find

    def counted(self: ContactNewton, *given: object, **named: object) -> object:
        before = self.solves
        status, found = find(self, *given, **named)  # type: ignore[arg-type]
        if found is not None:
            steps.append(self.solves - before)
        return status, found

    ContactNewton.find = counted  # type: ignore[assignment, method-assign]


if __name__ == "__main__":
    main()
