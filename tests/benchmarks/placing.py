"""Misplaced joints: how many are named, and how many joints of rigs as shipped are named falsely (R14).

    PYTHONPATH=.:kernels python -m tests.benchmarks.placing [rig ...] [--count 20] [--missed]

One joint at a time is displaced: a digit's by 8 mm, a spine's by 80 mm, another by 60 mm, along its bone or in any
direction, the same ones in every run. It counts as named if it is named only then, or if what is proposed changes by
more than half of the displacement. ``others``: joints that are named in its place or beside it, per displacement.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.rigs import RIGS
from warpjld.rig import Rig
from warpjld.skeleton.recognise.placing.check import check_placing
from warpjld.skeleton.recognise.placing.finding import Finding

__all__ = ["KINDS", "misplaced", "open_named", "table"]

_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
_DIGITS = (0.008, ("knuckle2", "knuckle3", "tip"))
_LIMBS = (0.06, ("knee", "elbow", "ankle", "wrist"))
_TRUNK = (0.06, ("hip", "shoulder", "top"))
_SPINE = (0.08, ("spine2", "spine3"))
KINDS: dict[str, tuple[float, tuple[str, ...], bool]] = {
    "digits along": (*_DIGITS, True),
    "digits any way": (*_DIGITS, False),
    "limbs along": (*_LIMBS, True),
    "limbs any way": (*_LIMBS, False),
    "trunk along": (*_TRUNK, True),
    "trunk any way": (*_TRUNK, False),
    "spine along": (*_SPINE, True),
    "spine any way": (*_SPINE, False),
}
"""Kind → size [m], last parts of the joints' names, and whether along the bone before."""
_NO_DIGITS = ("toe", "hand")  # of which a tip is no digit's


def open_named(name: str) -> Rig | None:
    """A rig of the skin benchmark's, or the built-in body; None where its file is not here."""
    if name in ("builtin", "builtin_body"):
        from warpjld.hand import build_hand
        from warpjld.hand.figure import build_body

        return build_hand("left", resolution=3000) if name == "builtin" else build_body()
    path = RIGS[name]
    if path is None or not (_DATA / path).is_file():
        return None
    from warpjld.io import load_rig

    return load_rig(_DATA / path)


def _findings(rig: Rig, rest: NDArray[np.float64]) -> dict[str, Finding]:
    moved = replace(rig.skeleton, rest=rest)
    return {one.joint: one for one in check_placing(moved, rig.surface.vertices, rig.surface.faces)}


def _candidates(rig: Rig, parts: Iterable[str]) -> list[int]:
    skeleton, body = rig.skeleton, "pelvis" in rig.skeleton.names
    return [
        j
        for j, name in enumerate(skeleton.names)
        if name.rpartition(".")[2] in parts
        and skeleton.parents[j] >= 0
        and name.removeprefix("left.").removeprefix("right.").partition(".")[0].rstrip("0123456789") not in _NO_DIGITS
        and (body or "wrist" not in name)
    ]


def _named(before: Finding | None, after: Finding | None, size: float) -> bool:
    if after is None or before is None:
        return after is not None
    if after.proposal is None or before.proposal is None:
        return False
    return bool(np.linalg.norm(np.subtract(after.proposal, before.proposal)) > 0.5e3 * size)


def misplaced(rig: Rig, kind: str, count: int, seed: int = 5) -> tuple[int, int, int, list[str]]:
    """Displacements that were named, their number, joints named besides, and a line for each that was missed."""
    size, parts, along = KINDS[kind]
    skeleton, joints = rig.skeleton, _candidates(rig, parts)
    if not joints:
        return 0, 0, 0, []
    shipped = _findings(rig, skeleton.rest)
    rng = np.random.default_rng(seed)
    named, others, missed = 0, 0, []
    for _ in range(count):
        j = joints[rng.integers(len(joints))]
        way = skeleton.rest[j] - skeleton.rest[skeleton.parents[j]]
        way = way * rng.choice([-1.0, 1.0]) if along else rng.normal(size=3)
        offset = size * way / np.linalg.norm(way)
        rest = skeleton.rest.copy()
        rest[j] += offset
        found = _findings(rig, rest)
        name = skeleton.names[j]
        besides = sorted(set(found) - set(shipped) - {name})
        others += len(besides)
        if _named(shipped.get(name), found.get(name), size):
            named += 1
        else:
            missed.append(f"{name} by {np.round(1e3 * offset).astype(int).tolist()} mm; named: {besides or 'none'}")
    return named, count, others, missed


def table(names: Iterable[str], count: int, show_missed: bool = False) -> str:
    """The table as Markdown, one row a rig."""
    out = [
        f"| rig | as shipped | {' | '.join(KINDS)} | others |",
        f"|---|--:|{'--:|' * len(KINDS)}--:|",
    ]
    for name in names:
        rig = open_named(name)
        if rig is None:
            print(f"{name}: no file here", file=sys.stderr)
            continue
        cells, others, all_ = [], 0, 0
        for kind in KINDS:
            named, tried, besides, missed = misplaced(rig, kind, count)
            cells.append(f"{named}/{tried}" if tried else "")
            others, all_ = others + besides, all_ + tried
            for line in missed if show_missed else ():
                print(f"{name}, {kind}: {line}", file=sys.stderr)
        shipped = len(_findings(rig, rig.skeleton.rest))
        out.append(f"| {name} | {shipped} | {' | '.join(cells)} | {others / max(all_, 1):.2f} |")
        print(out[-1], file=sys.stderr, flush=True)
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rigs", nargs="*", default=[*RIGS, "builtin_body"])
    parser.add_argument("--count", type=int, default=20, help="displacements of each kind")
    parser.add_argument("--missed", action="store_true", help="list those that were not named")
    given = parser.parse_args()
    print(table(given.rigs, given.count, given.missed))


if __name__ == "__main__":
    main()
