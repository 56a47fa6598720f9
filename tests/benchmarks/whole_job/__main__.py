"""How long the whole job takes as users do it: one process that reads a rig and a motion and writes a vertex cache.

    python -m tests.benchmarks.whole_job [--blender PYTHON] [--repeats 3] [--rig FILE] [--motion FILE]

``warpjld deform RIG MOTION -o x.pc2`` with nothing kept, with a kept binding, and with an empty cache of kernels too,
beside one process of Blender that imports both, evaluates every frame and writes the same file (``--blender`` names a
Python that has `bpy`; its script knows the bones of the Anny body and of the CMU walk in ``shared/data``). Rows are
measured in turn, so that a machine that slows down slows all of them; compare the best of each.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

_ROOT = Path(__file__).resolve().parents[3]
_DATA = _ROOT.parent / "shared" / "data"
_BODY = _DATA / "body_anny" / "body_104joints.glb"
_WALK = _DATA / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh"
_IN_BLENDER = Path(__file__).with_name("in_blender.py")


@click.command()
@click.option("--blender", help="A Python that has bpy.")
@click.option("--repeats", default=3, show_default=True)
@click.option("--rig", type=click.Path(path_type=Path), default=_BODY, help="Another rig.")
@click.option("--motion", type=click.Path(path_type=Path), default=_WALK, help="Another motion.")
def main(blender: str | None, repeats: int, rig: Path, motion: Path) -> None:
    """Print seconds of wall clock and of the processor as a table."""
    for needed in (rig, motion):
        if not needed.is_file():
            sys.exit(f"skipped: {needed} is not there")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        times = _measured(blender, repeats, rig, motion, folder)
    table = Table(title=f"{rig.name} moved by {motion.name}, PC2 written: best of {repeats}")
    for heading in ("", "wall [s]", "processor [s]", "wall / Blender"):
        table.add_column(heading, justify="left" if not heading else "right")
    least = {row: tuple(min(column) for column in zip(*runs, strict=True)) for row, runs in times.items()}
    for row, (wall, processor) in least.items():
        beside = f"{wall / least['Blender'][0]:.2f}" if "Blender" in least else ""
        table.add_row(row, f"{wall:.2f}", f"{processor:.2f}", beside)
    Console().print(table)


def _measured(
    blender: str | None, repeats: int, rig: Path, motion: Path, folder: Path
) -> dict[str, list[tuple[float, float]]]:
    out = folder / "out.pc2"
    deform = [sys.executable, "-m", "warpjld", "deform", str(rig), str(motion), "-o", str(out), "--quiet"]
    kernels, kept = folder / "kernels", folder / "kept"
    path = os.pathsep.join(str(part) for part in (_ROOT, _ROOT / "kernels"))
    # bytecode is kept, as it is wherever a package was installed
    base = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    base |= {"PYTHONPATH": path, "WARP_CACHE_PATH": str(kernels), "WARPJLD_CACHE": "off"}
    rows = {
        "kernels compiled": (deform, base | {"WARP_CACHE_PATH": str(folder / "none")}),
        "nothing kept": (deform, base),
        "binding kept": (deform, base | {"WARPJLD_CACHE": str(kept)}),
    }
    if blender:
        rows["Blender"] = ([blender, str(_IN_BLENDER), str(rig), str(motion), str(out)], base)
    for command, environment in rows.values():  # files into memory, kernels and binding into their caches
        _seconds(command, environment)
    times = defaultdict(list)
    for _ in range(repeats):
        for row, (command, environment) in rows.items():
            if row == "kernels compiled":
                shutil.rmtree(folder / "none", ignore_errors=True)
            times[row].append(_seconds(command, environment))
            out.unlink()
    return times


def _seconds(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Wall clock and processor seconds of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
