"""Whether the covering depends on the rigs it was developed on: the same measures on altered rigs.

    python -m tests.benchmarks.skin.variants [--rigs webxr,anny_hand,godot_low,anny_low] [--limit]

Every hand is altered in a dozen ways (``altered.py``) and curled. A line an alteration has the worst of all rigs.
``--limit`` closes fists by ``TOUCH LIMIT`` too, which takes minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import click
import numpy as np

from tests.benchmarks.skin.altered import ALTERATIONS
from tests.benchmarks.skin.measures import Measured, Measuring
from tests.benchmarks.skin.methods import METHODS
from tests.benchmarks.skin.poses import pose
from tests.benchmarks.skin.rigs import BenchRig, load
from tests.benchmarks.touch import random_angles
from warpjld.covering import bind_rig
from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.runtime.quiet import silence_warp
from warpjld.skeleton.kinematics import poses_from_angles
from warpjld.touch import Touch, close_until_touch

_CURLS = ("curl_06", "curl_09")
_FISTS = 3  # random fists a rig


@dataclass(frozen=True)
class _Row:
    """One altered rig: measures by LBS and by the covering in each curl, and faces crossing in limited fists."""

    lbs: dict[str, Measured]
    ours: dict[str, Measured]
    fists: int


@click.command()
@click.option("--rigs", default="webxr,anny_hand,godot_low,anny_low", show_default=True)
@click.option("--limit", "limited", is_flag=True, help="Close fists by TOUCH LIMIT too.")
def main(rigs: str, limited: bool) -> None:
    """Print a table in Markdown."""
    silence_warp()
    benches = [bench for name in rigs.split(",") if (bench := load(name)) is not None]
    if not benches:
        sys.exit("skipped: none of these rigs is in the data folder")
    heads = [
        "alteration",
        "rigs",
        "folds at 0.6 (LBS)",
        "folds at 0.9 (LBS)",
        "volume at 0.6; 0.9 [%]",
        "roughness / LBS",
    ]
    heads += ["crossing in fists"] * limited
    print("| " + " | ".join(heads) + " |")
    print("|" + "---|" * len(heads))
    for name in ALTERATIONS:
        rows = list(_measured(benches, name, limited))
        if rows:
            print(_line(name, rows, limited), flush=True)


def _measured(benches: list[BenchRig], name: str, limited: bool) -> Iterator[_Row]:
    for bench in benches:
        rig = ALTERATIONS[name](bench)
        covering = bind_rig(rig)
        altered = BenchRig(bench.name, rig, covering, surface_parts(covering))
        measuring = Measuring(altered)
        lbs: dict[str, Measured] = {}
        ours: dict[str, Measured] = {}
        for curl in _CURLS:
            posed = pose(curl, rig.skeleton)
            assert posed is not None
            for method, into in (("lbs", lbs), ("ours", ours)):
                deform = METHODS[method](altered)
                if deform is not None:
                    into[curl] = measuring.measure(deform(posed.poses)[0], posed)
        yield _Row(lbs, ours, _crossing_fists(altered) if limited else 0)


def _crossing_fists(bench: BenchRig) -> int:
    """Faces that cross in random fists closed by ``TOUCH LIMIT`` one by one, in excess of those at rest."""
    covering, count = bench.covering, 0
    touch = Touch.of(covering)
    poses = poses_from_angles(covering.skeleton, random_angles(covering.skeleton, "fist", _FISTS, seed=3))
    for k in range(len(poses)):
        closed, _ = close_until_touch(covering, poses[k : k + 1], touch)
        points = touch.apply(covering.deform(closed), closed, threads=1)[0]
        pairs = crossing_faces(points[0], covering.surface.faces).pairs
        count += len(np.unique(touch.new_crossings(pairs)))
    return count


def _line(name: str, rows: list[_Row], limited: bool) -> str:
    """The worst of all rigs, by LBS in brackets."""

    def folds(method: str, curl: str) -> int:
        return max(getattr(row, method)[curl].joint + getattr(row, method)[curl].palm for row in rows if row.lbs)

    cells = [name, str(len(rows))]
    cells += [f"{folds('ours', curl)} ({folds('lbs', curl)})" for curl in _CURLS]
    cells.append("; ".join(f"{max((row.ours[curl].volume for row in rows), key=abs):+.1f}" for curl in _CURLS))
    ratios = [row.ours[curl].roughness / row.lbs[curl].roughness for row in rows for curl in _CURLS if row.lbs]
    cells.append(f"{min(ratios):.2f} to {max(ratios):.2f}")
    return "| " + " | ".join([*cells, *([str(sum(row.fists for row in rows))] if limited else [])]) + " |"


if __name__ == "__main__":
    main()
