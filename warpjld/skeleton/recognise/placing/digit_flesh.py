"""Where the joints of digits lie in their flesh, compared with the other digits of the same hand (R14).

One criterion: rigs differ in where they put joints, between back and pad or before the end of a fingertip, but each
does the same in all fingers. A joint is expected where the median of the other fingers has it. Thumbs, and hands of few
fingers, are compared with the middle of the range of existing rigs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.recognise.section import skin_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["InFlesh", "digits_in_flesh"]

Array = NDArray[np.float64]

_COMPARED = ("knuckle2", "knuckle3", "tip")
_FINGERS = tuple(digit for digit in DIGITS if digit != "thumb")
_USUAL = {
    "knuckle2": (0.33, 0.5, 0.0),
    "knuckle3": (0.35, 0.5, 0.0),
    "tip": (0.47, 0.5, 1.3),
    "thumb.knuckle2": (0.38, 0.5, 0.0),
    "thumb.knuckle3": (0.42, 0.5, 0.0),
}
"""Middle of the range in existing rigs: share of the flesh from the back and from one side,
and flesh beyond a tip per half thickness."""
_BESIDE_OTHERS = (0.16, 0.22, 0.55)
"""Tolerance of each against the other fingers: half as much again as the largest deviation in existing rigs (0.1, 0.14
and 0.36), as the three are taken together."""
_THICK = 2.5  # largest thickness of a digit per length of the bones before: beyond, rays pass holes
_BESIDE_USUAL = (0.36, 0.34, 0.9)  # likewise against the usual places (0.23, 0.23, 0.55)


@dataclass(frozen=True, eq=False)
class InFlesh:
    """Deviation of a digit's joint from its expected place in the flesh.

    Attributes:
        offset: Displacement to that place [m], shape (3,).
        deviation: Its size in units of the tolerance: 1 at the limit.
        ahead: Flesh beyond a tip, and expected there [m]; None for other joints.
        sides: Flesh at the back, front, one side and the other side [m].
        aside: Whether the deviation is across the bone rather than along it.
    """

    offset: Array
    deviation: float
    ahead: tuple[float, float] | None
    sides: tuple[float, float, float, float]
    aside: bool


def digits_in_flesh(skeleton: Skeleton, vertices: Array, faces: NDArray[np.int32]) -> dict[str, InFlesh]:
    """Deviations of middle and outer joints of digits, and of their tips, by name; those without flesh are left out.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
    """
    names = [
        name
        for side in ("left.", "right.", "")
        for digit in DIGITS
        for joint in _COMPARED
        if (name := f"{side}{digit}.{joint}") in skeleton.names
    ]
    if not names:
        return {}
    joints = [skeleton.index(name) for name in names]
    bone, axis = skeleton.directions[joints], skeleton.axes[joints]
    rays = np.stack([np.cross(bone, axis), -np.cross(bone, axis), axis, -axis, bone], axis=1)
    origins = np.repeat(skeleton.rest[joints], 5, axis=0)
    reach = skin_hits(vertices, faces, origins, rays.reshape(-1, 3)).reshape(-1, 5)
    bones = np.linalg.norm(skeleton.rest - skeleton.rest[skeleton.parents], axis=1)
    lengths = np.maximum(bones, bones[skeleton.parents])[joints]  # of two, as a misplaced joint shortens one
    seen = {
        name: row
        for name, row, length in zip(names, reach, lengths, strict=True)
        if np.isfinite(row[:4]).all() and max(row[0] + row[1], row[2] + row[3]) <= _THICK * length
    }
    places = {name: _place(name, row) for name, row in seen.items()}
    out = {}
    for name, turned in zip(names, rays, strict=True):
        if name in seen:
            out[name] = _compare(name, places, seen[name], turned[[0, 2, 4]])
    return out


def _place(name: str, reach: Array) -> Array:
    """Shares from the back and from the side, and flesh beyond a tip per half thickness, shape (3,)."""
    back, front, side, other, ahead = reach
    pad = ahead / _half(reach) if name.endswith(".tip") and np.isfinite(ahead) else 0.0
    return np.array([back / (back + front), side / (side + other), pad])


def _half(reach: Array) -> float:
    return float(min(reach[0] + reach[1], reach[2] + reach[3]) / 2)


def _compare(name: str, places: Mapping[str, Array], reach: Array, ways: Array) -> InFlesh:
    before, _, joint = name.rpartition(".")
    side, _, digit = before.rpartition(".")
    others = [
        places[other] for d in _FINGERS if d != digit and (other := f"{side}{'.' if side else ''}{d}.{joint}") in places
    ]
    usual = np.array(_USUAL.get(f"{digit}.{joint}", _USUAL[joint]))
    expected, tolerance = usual, np.array(_BESIDE_USUAL)
    if len(others) >= 3 and (digit != "thumb" or joint == "tip"):
        expected, tolerance = np.median(others, axis=0), np.array(_BESIDE_OTHERS)
        expected[1] = usual[1]  # in the middle between the sides, whatever the other fingers are
    off = places[name] - expected
    sizes = np.array([reach[0] + reach[1], reach[2] + reach[3], _half(reach)])
    scaled = off / tolerance
    beyond = (float(reach[4]), float(expected[2] * sizes[2])) if places[name][2] > 0.0 else None
    if beyond is None:
        scaled[2] = off[2] = 0.0
    back, front, one, other_side = (float(flesh) for flesh in reach[:4])
    return InFlesh(
        (off * sizes) @ ways,
        float(np.linalg.norm(scaled)),
        beyond,
        (back, front, one, other_side),
        bool(np.abs(scaled[:2]).max() > abs(scaled[2])),
    )
