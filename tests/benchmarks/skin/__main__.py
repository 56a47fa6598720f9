"""How skin looks by measure: every rig × pose × method, one table.

    python -m tests.benchmarks.skin [--rigs godot_low,webxr] [--poses curl] [--methods lbs,ours] [--csv FILE]
        [--sheet DIR] [--summary FILE]

Names may be cut short (``curl`` is all curls, ``shoulder_150`` all of them). Without options everything is run but the
calibrated covering (--calibrated).
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.measures import Measured, Measuring
from tests.benchmarks.skin.methods import METHODS, Deform
from tests.benchmarks.skin.poses import POSES, pose
from tests.benchmarks.skin.rigs import RIGS, load
from tests.benchmarks.skin.sheet import draw_sheet
from tests.benchmarks.skin.summary import summary
from warpjld.runtime.quiet import silence_warp

_COLUMNS = ("rig", "pose", "method", *(f.name for f in fields(Measured)), "ms")


@click.command()
@click.option("--rigs", default="", help=f"Of {', '.join(RIGS)}.")
@click.option("--poses", default="", help=f"Of {', '.join(POSES)}.")
@click.option("--methods", default="", help=f"Of {', '.join(METHODS)}.")
@click.option("--calibrated", is_flag=True, help="Calibrate too (minutes a rig).")
@click.option("--sheet", "sheets", type=click.Path(path_type=Path), help="Draw a sheet of every rig into this folder.")
@click.option("--csv", "csv_file", type=click.Path(path_type=Path), help="Write the table there too.")
@click.option("--summary", "short", type=click.Path(path_type=Path), help="Write a line a rig and method there.")
def main(
    rigs: str,
    poses: str,
    methods: str,
    calibrated: bool,
    sheets: Path | None,
    csv_file: Path | None,
    short: Path | None,
) -> None:
    """Print the table in Markdown."""
    silence_warp()
    chosen = [m for m in _chosen("methods", methods, METHODS) if methods or m != "calibrated"]
    if calibrated and "calibrated" not in chosen:
        chosen.append("calibrated")
    wanted = _chosen("poses", poses, POSES)
    rows: list[tuple[str | float, ...]] = []
    kept: list[tuple[str, str, str, Measured, float]] = []
    _print_row(_COLUMNS)
    _print_row(["---"] * len(_COLUMNS))
    for name in _chosen("rigs", rigs, RIGS):
        bench = load(name)
        if bench is None:
            print(f"{name}: not in the data folder", file=sys.stderr)
            continue
        measuring = Measuring(bench)
        ready: dict[str, Deform] = {}
        for method in chosen:
            deform = METHODS[method](bench)
            if deform is not None:
                ready[method] = deform
        drawn: dict[str, list[NDArray[np.floating]]] = {}
        for pose_name in wanted:
            posed = pose(pose_name, bench.rig.skeleton)
            if posed is None:
                continue
            for method, deform in ready.items():
                deform(posed.poses)  # the first one packs, factorises or compiles
                start = time.perf_counter()
                points = deform(posed.poses)[0]
                took = 1e3 * (time.perf_counter() - start)
                kept.append((name, pose_name, method, measuring.measure(points, posed), took))
                rows.append((name, pose_name, method, *astuple(kept[-1][3]), took))
                _print_row(rows[-1])
                drawn.setdefault(pose_name, []).append(points)
        if sheets is not None and drawn:
            draw_sheet(bench, list(ready), drawn, sheets)
    if csv_file is not None:
        with csv_file.open("w", newline="") as out:
            csv.writer(out).writerows([_COLUMNS, *rows])
    if short is not None:
        short.write_text("\n".join(summary(kept)) + "\n", encoding="utf-8")


def _chosen(option: str, text: str, names: Iterable[str]) -> list[str]:
    """Names that are asked for, exactly or by what they begin with; all of them by default."""
    known = list(names)
    out: list[str] = []
    for asked in filter(None, (part.strip() for part in text.split(","))):
        found = [asked] if asked in known else [n for n in known if n.startswith(asked)]
        if not found:
            raise click.BadParameter(f"no '{asked}'; there are {', '.join(known)}", param_hint=f"--{option}")
        out += [n for n in found if n not in out]
    return out or known


def _print_row(cells: Sequence[str | float]) -> None:
    print("| " + " | ".join(f"{c:.2f}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
