"""Layout of a hand of given size: joints, frames of the digits, and the swept solids of its flesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.hand import design
from warpjld.hand.sweep import Sweep

__all__ = ["Plan", "PlannedDigit", "plan_hand"]

Array = NDArray[np.float64]

_ROOT = 30.0  # length of a digit's flesh proximal to its base joint [mm]
_FINGER_SQUARENESS, _THUMB_SQUARENESS = 0.12, 0.10  # squareness of cross-sections, 0 for ellipses
_CAP = 0.62  # fraction of the last phalanx where the tip's rounding begins
_TIP = 0.62  # depth of the extremity joint below the skin, in half-widths
_NAIL = (0.61, 0.26, 0.58)  # middle and half-length in units of the last phalanx, half-width in half-widths


@dataclass(frozen=True, eq=False)
class PlannedDigit:
    """Layout of a digit.

    Attributes:
        joints: Positions of base, knuckle 2, knuckle 3 and tip [mm], shape (4, 3).
        dorsal: Dorsal direction at each, shape (4, 3).
        flesh: Its swept solid.
    """

    joints: Array
    dorsal: Array
    flesh: Sweep


@dataclass(frozen=True, eq=False)
class Plan:
    """Joints [mm] of a left hand and the flesh around them; ``stretch`` scales the design's axes."""

    forearm: Array
    wrist: Array
    carpometacarpal: dict[str, Array]
    digits: dict[str, PlannedDigit]
    muscles: tuple[Sweep, ...]
    stretch: Array


def plan_hand(along: float, across: float, proportions: Mapping[str, tuple[float, float]]) -> Plan:
    """Lay out a left hand in the rig's axes: radial +x, dorsal +y, distal -z.

    Args:
        along: Scale of distal measures.
        across: Scale of radial and dorsal measures, thicknesses included.
        proportions: Digit → (scale of its length, scale of its thickness).
    """
    stretch = np.array([across, across, along])

    def place(point: design.Point) -> Array:
        return np.array(point) * stretch * (1.0, 1.0, -1.0)

    digits = {}
    for name, finger in design.FINGER_DESIGNS.items():
        long, thick = proportions.get(name, (1.0, 1.0))
        turn = np.radians(finger.splay)
        heading = np.array([np.sin(turn), 0.0, -np.cos(turn)])
        lean = np.radians(finger.roll)
        up = _square(np.array([np.sin(lean), np.cos(lean), 0.0]), heading)
        bend = np.radians(np.cumsum(design.REST_FLEXION))
        steps = np.cos(bend)[:, None] * heading - np.sin(bend)[:, None] * up
        digits[name] = _digit(
            place(finger.base), steps, np.array(finger.lengths) * along * long, up,
            finger.half_width * across * thick, design.FINGER_PROFILE, _ROOT * along, _FINGER_SQUARENESS,
        )  # fmt: skip
    long, thick = proportions.get("thumb", (1.0, 1.0))
    side, down = np.radians(design.THUMB_ABDUCTION), np.radians(design.THUMB_DEPTH)
    steps = np.column_stack([np.sin(side) * np.cos(down), -np.sin(down), -np.cos(side) * np.cos(down)])
    mean = unit(steps.sum(axis=0))
    up = _square(np.array([0.0, 1.0, 0.0]), mean)
    roll = np.radians(design.THUMB_ROLL)
    up = np.cos(roll) * up + np.sin(roll) * np.cross(up, mean) * np.sign(np.cross(up, mean)[0])
    digits["thumb"] = _digit(
        place(design.THUMB_BASE), steps, np.array(design.THUMB_LENGTHS) * along * long, up,
        design.THUMB_HALF_WIDTH * across * thick, design.THUMB_PROFILE, _ROOT * along, _THUMB_SQUARENESS,
    )  # fmt: skip
    return Plan(
        forearm=place(design.FOREARM),
        wrist=place(design.WRIST),
        carpometacarpal={name: place(point) for name, point in design.CARPOMETACARPAL.items()},
        digits=digits,
        muscles=tuple(_spindle(place(m.start), place(m.end), m.profile, across) for m in design.MUSCLES),
        stretch=stretch,
    )


def _digit(
    base: Array, steps: Array, lengths: Array, up: Array, half: float,
    profile: tuple[tuple[float, ...], ...], root: float, squareness: float,
) -> PlannedDigit:  # fmt: skip
    """Lay out a digit.

    Args:
        base: Base joint [mm], shape (3,).
        steps: Directions of the three segments, shape (3, 3).
        lengths: Their lengths, the last to the skin [mm], shape (3,).
        up: Dorsal direction, shape (3,).
        half: Half-width [mm], the unit of the profile.
        profile: Rows as of ``design.FINGER_PROFILE``.
        root: Length of the flesh proximal to the base joint [mm].
        squareness: Squareness of its cross-sections.
    """
    joints = base + np.vstack([np.zeros(3), np.cumsum(steps * lengths[:, None], axis=0)])
    skin = joints[3].copy()
    joints[3] = skin - steps[2] * _TIP * half  # the extremity joint lies inside the skin
    axis = unit(skin - base)
    dorsal = _square(up, axis)
    frame = np.vstack([np.cross(dorsal, axis), dorsal, axis])
    local = (np.vstack([joints[:3], skin]) - base) @ frame.T
    stops = np.concatenate([[-root], local[:, 2]])  # axial coordinates of the profile's joints -1, 0, 1, 2, 3
    sizes = [
        (stops[int(j) + 1] + f * (stops[int(j) + 2] - stops[int(j) + 1]), half * w, half * d, half * p)
        for j, f, w, d, p in profile
    ]
    last = stops[4] - stops[3]
    first = local[1] - local[0]
    before = -root * first / first[2]
    flesh = Sweep.through(
        base,
        frame,
        (-root, local[3, 2]),
        (-0.1 * root, stops[3] + _CAP * last),
        squareness,
        [(p[2], p[0], p[1]) for p in (before, *local)],
        sizes,
        (stops[3] + _NAIL[0] * last, _NAIL[1] * last, _NAIL[2] * half),
    )
    per_joint = np.vstack([_square(dorsal, d) for d in (*steps, steps[2])])
    return PlannedDigit(joints, per_joint, flesh)


def _spindle(start: Array, end: Array, profile: tuple[tuple[float, ...], ...], across: float) -> Sweep:
    """Swept solid of a muscle between two points [mm], its profile's measures scaled by ``across``."""
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    palmar = _square(np.array([0.0, -1.0, 0.0]), axis)
    return Sweep.through(
        start,
        np.vstack([np.cross(palmar, axis), palmar, axis]),
        (0.0, length),
        (0.3 * length, 0.7 * length),
        0.0,
        [(0.0, 0.0, 0.0), (length, 0.0, 0.0)],
        [(f * length, w * across, a * across, b * across) for f, w, a, b in profile],
    )


def _square(vector: Array, axis: Array) -> Array:
    """Unit vector along the component of a vector perpendicular to an axis."""
    return unit(vector - axis * (vector @ axis) / (axis @ axis))
