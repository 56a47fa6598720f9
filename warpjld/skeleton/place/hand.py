"""Proposal of a hand's 25 points from its surface alone: from fingertips, webs, wrist and average proportions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.place.branches import Branch, centre_line, find_branches, point_at
from warpjld.skeleton.place.solid import VoxelSolid

__all__ = ["place_hand"]

Array = NDArray[np.float64]

_FINGERS = ("index", "middle", "ring", "pinky")
# mean lengths [mm] of proximal, middle and distal phalanx, the last with the pad (Buryanov, Kotiuk 2010)
_PHALANGES = {
    "index": (39.8, 22.4, 19.7),
    "middle": (44.6, 26.3, 21.4),
    "ring": (41.4, 25.7, 21.3),
    "pinky": (32.7, 18.1, 19.7),
}
_THUMB = (46.2, 31.6, 25.6)
"""Metacarpal, proximal and distal phalanx with the pad [mm] (same source)."""
_WEB = 0.5  # share of the proximal phalanx between knuckle and web
_TO_WEB = 1.37  # wrist to web, per free length of the middle finger: a palm is .57, a finger .42 of a hand's length
_WRIST = (1.15, 1.7)  # range before the web that is searched for the wrist, in free lengths
_CARPAL = 0.36  # share of the way from the wrist to a finger's base
_CMC = (0.27, 0.22)  # first carpometacarpal joint: shares of wrist to web, forward and to the thumb's side
_LEAST = 0.12  # shortest branch that counts as a digit, per longest distance
_THICK = 2.0  # smallest ratio of the forearm end's volume to that of the thickest digit's end


@dataclass(frozen=True)
class _Digit:
    """A digit's centre line from its end to its web."""

    branch: Branch
    line: Array
    length: float


def place_hand(solid: VoxelSolid, arm: Array | None = None, label: str = "the hand") -> dict[str, Array]:
    """Propose a hand's points.

    Args:
        solid: A hand, possibly with part of the forearm, connected.
        arm: A point at the forearm's end; found if None.
        label: Name of the surface in messages.

    Returns:
        The 25 points, names without the side [the solid's unit], each shape (3,).

    Raises:
        InputError: There are no five digits apart from one another.
    """
    start = solid.nearest(_arm_end(solid, label) if arm is None else arm)
    distance = solid.distances(start)
    digits = find_branches(solid, distance, _LEAST * float(distance[np.isfinite(distance)].max()))[:5]
    if len(digits) < 5:
        raise InputError(
            f"{label}: found {len(digits)} separate digits, expected five: spread the fingers of the digitised hand"
        )
    furthest = max(digits, key=lambda b: float(distance[b.tip]))
    first_web = max(b.parting for b in digits if b is not furthest)
    traced = [_trace(solid, distance, b, first_web if b is furthest else b.parting) for b in digits]
    thumb = traced[_thumb_of(traced)]
    fingers = [d for d in traced if d is not thumb]
    web = float(np.median([float(distance[d.branch.tip]) - d.length for d in fingers]))
    free = float(np.median([d.length for d in fingers]))
    wrist, wrist_at = _wrist(solid, distance, web, free)
    palm = web - wrist_at

    heads = np.array([d.line[-1] for d in fingers])
    forward = unit(heads.mean(axis=0) - wrist)
    aside = thumb.line[-1] - heads.mean(axis=0)
    across = heads - heads.mean(axis=0)
    row = np.linalg.svd(across - np.outer(across @ forward, forward))[2][0]
    radial = unit(row * np.sign(row @ aside or 1.0))
    normal = np.cross(forward, radial)
    order = np.argsort(-(heads @ radial))
    points = {"wrist": wrist}
    for name, k in zip(_FINGERS, order, strict=True):
        points |= _finger(solid, name, fingers[k], wrist, palm, normal)
    points |= _thumb(solid, thumb, wrist, palm, forward, radial, normal)
    return points


def _thumb_of(digits: list[_Digit]) -> int:
    """Index of the thumb among five digits: its base is apart from the others and it points another way."""
    bases = np.array([d.line[-1] for d in digits])
    directions = np.array([unit(d.line[0] - d.line[-1]) for d in digits])
    apart = np.linalg.norm(bases[:, None] - bases[None], axis=2)
    apart = (apart + np.diag(np.full(len(digits), np.inf))).min(axis=1)
    deviations = [1.0 - float(unit(directions.sum(axis=0) - way) @ way) for way in directions]
    return int(np.argmax(apart / np.median(apart) + 2.0 * np.array(deviations)))


def _arm_end(solid: VoxelSolid, label: str) -> Array:
    """Centre of the forearm's end: the thickest of a hand's six ends."""
    start = solid.nearest(solid.points.mean(axis=0))
    distance = solid.distances(start)
    reach = float(distance[np.isfinite(distance)].max())
    ends = find_branches(solid, distance, _LEAST * reach)[:8]
    outer = [b.voxels[distance[b.voxels] > distance[b.tip] - 0.15 * reach] for b in ends]
    thick = [len(voxels) for voxels in outer]
    if len(ends) < 6:
        raise InputError(
            f"{label}: found {len(ends)} extremities, expected five digits and an arm: "
            "spread the fingers of the digitised hand"
        )
    ranked = np.argsort(thick)
    if thick[ranked[-1]] < _THICK * thick[ranked[-2]]:
        raise InputError(f"{label}: no extremity is clearly thicker than the others, as a forearm should be")
    return np.asarray(solid.points[outer[int(ranked[-1])]].mean(axis=0))


def _trace(solid: VoxelSolid, distance: Array, branch: Branch, web: float) -> _Digit:
    own = branch.voxels[distance[branch.voxels] >= web]
    # distances from the tip within the digit alone
    mine = np.zeros(len(solid.points), dtype=bool)
    mine[own] = True
    piece = solid.part(mine)
    kept = np.flatnonzero(mine)
    from_tip = np.full(len(solid.points), np.inf)
    from_tip[kept] = piece.distances(int(np.flatnonzero(kept == branch.tip)[0]))
    own = own[np.isfinite(from_tip[own])]
    line, _ = centre_line(solid, own, from_tip, 2.0 * solid.size)
    length = float(distance[branch.tip]) - web
    keep = max(3, int(0.8 * len(line)))  # the last slices lean towards the neighbour: extrapolate straight instead
    line = np.vstack([solid.points[branch.tip], line[1:keep]])
    line = np.vstack([line, point_at(line, max(length, 1.02 * _arc_length(line)))])
    return _Digit(branch, line, length)


def _arc_length(line: Array) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _wrist(solid: VoxelSolid, distance: Array, web: float, free: float) -> tuple[Array, float]:
    """The narrowest section between hand and forearm near the expected wrist; its centre and distance."""
    expected = web - _TO_WEB * free
    near = np.flatnonzero(np.isfinite(distance) & (distance < web))
    centres, areas = centre_line(solid, near, distance, 2.0 * solid.size)
    at = (np.arange(len(areas)) + 0.5) * 2.0 * solid.size
    # slices near the start are spherical: widths are meaningless within half a width of it
    known = 0.5 * float(np.sqrt(np.median(areas)))
    low, high = max(web - _WRIST[1] * free, known), web - _WRIST[0] * free
    window = np.flatnonzero((at >= low) & (at <= high))
    if expected < known or not len(window):  # the surface ends at the wrist
        k = int(np.abs(at - max(expected, 2.0 * solid.size)).argmin())
        return centres[k], float(at[k])
    width = np.sqrt(areas[window] / areas[window].min())
    # a deviation by half a free length from the expected place costs a tenth of the width
    k = window[int((width + 0.1 * ((at[window] - expected) / (0.5 * free)) ** 2).argmin())]
    return centres[k], float(at[k])


def _finger(solid: VoxelSolid, name: str, digit: _Digit, wrist: Array, palm: float, normal: Array) -> dict[str, Array]:
    first, second, third = _PHALANGES[name]
    # knuckle behind the web: mean of the scales that the palm and the finger's free length give
    behind = 0.5 * _WEB * first * (palm / 117.0 + digit.length / (first + second + third - _WEB * first))
    web = digit.line[-1]
    own = unit(web - point_at(digit.line, 0.5 * digit.length))
    towards = unit(wrist - web)
    base = _middle(solid, web + behind * unit(0.5 * own + 0.5 * towards), normal)
    line = np.vstack([digit.line, base])
    whole = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    scale = whole / (first + second + third)
    return {
        f"{name}.carpometacarpal": _middle(solid, wrist + _CARPAL * (base - wrist), normal),
        f"{name}.base": base,
        f"{name}.knuckle2": point_at(line, (second + third) * scale),
        f"{name}.knuckle3": point_at(line, third * scale),
        f"{name}.tip": _tip(solid, line, third * scale),
    }


def _thumb(
    solid: VoxelSolid, digit: _Digit, wrist: Array, palm: float, forward: Array, radial: Array, normal: Array
) -> dict[str, Array]:
    first, second, third = _THUMB
    base = wrist + palm * (_CMC[0] * forward + _CMC[1] * radial)
    base = _middle(solid, solid.points[solid.nearest(base)], normal)
    line = np.vstack([digit.line, base])
    scale = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) / (first + second + third)
    return {
        "thumb.base": base,
        "thumb.knuckle2": _inside(solid, point_at(line, (second + third) * scale)),
        "thumb.knuckle3": point_at(line, third * scale),
        "thumb.tip": _tip(solid, line, third * scale),
    }


def _tip(solid: VoxelSolid, line: Array, last: float) -> Array:
    """Centre of the rounded fingertip: its distance from the end is the local thickness of the flesh."""
    end = point_at(line, 0.35 * last)
    near = np.linalg.norm(solid.points - end, axis=1) < 0.35 * last
    radius = float(solid.depth[near].max()) if near.any() else 0.35 * last
    return point_at(line, min(radius, 0.5 * last))


def _inside(solid: VoxelSolid, place: Array) -> Array:
    nearest = solid.points[solid.nearest(place)]
    return place if np.linalg.norm(nearest - place) < 2.0 * solid.size else nearest


def _middle(solid: VoxelSolid, place: Array, normal: Array) -> Array:
    """The middle of the flesh along the palm's normal through a place."""
    place = solid.points[solid.nearest(place)]
    away = solid.points - place
    high = away @ normal
    column = high[np.linalg.norm(away - np.outer(high, normal), axis=1) < 1.5 * solid.size]
    # only the connected part around the place: a thumb may lie in front of the palm
    column = np.sort(column)
    breaks = np.flatnonzero(np.diff(column) > 3.0 * solid.size)
    below = column[: int(np.searchsorted(column, 0.0))]
    low = column[breaks[breaks < len(below)].max(initial=-1) + 1]
    later = breaks[breaks >= max(len(below) - 1, 0)]
    high_end = column[later.min()] if len(later) else column[-1]
    return np.asarray(place + (low + high_end) / 2 * normal)
