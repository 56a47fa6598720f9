"""Where everything in the hand lies: joints, digit frames and sizes, for a given length and breadth.

Numbers are millimetres on a left hand 190 mm long and 85 mm broad, palm down, as (radial, dorsal, distal) from the
wrist. Distal measures scale with the length, the others with the breadth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.hand.sweep import Sweep

__all__ = ["BREADTH", "LENGTH", "Digit", "Plan", "plan_hand"]

Array = NDArray[np.float64]

LENGTH, BREADTH = 190.0, 85.0

FOREARM, WRIST = (0.27, 0.28, -44.0), (-0.1, -0.16, 0.0)  # at their sections' centroids
CARPOMETACARPAL = {
    "index": (12.0, 2.0, 29.0),
    "middle": (2.0, 3.0, 29.5),
    "ring": (-8.0, 2.0, 29.0),
    "pinky": (-17.5, -0.5, 27.0),
}


@dataclass(frozen=True)
class _Finger:
    base: tuple[float, float, float]
    lengths: tuple[float, float, float]  # phalanges; the last to the skin
    half_width: float  # at knuckle 2
    splay: float  # degrees, to the radial side
    roll: float  # degrees: the nail leans to the radial side


_FINGERS = {
    "index": _Finger((26.3, 0.0, 85.0), (43.0, 25.5, 24.0), 9.4, 6.0, 6.0),
    "middle": _Finger((4.0, 1.5, 87.0), (46.5, 30.0, 26.5), 9.5, 0.5, 0.0),
    "ring": _Finger((-17.3, 0.0, 80.5), (43.5, 28.5, 25.0), 8.9, -5.5, -6.0),
    "pinky": _Finger((-36.3, -3.5, 71.5), (35.0, 21.5, 22.0), 7.8, -13.0, -13.0),
}
_CURL = (5.0, 8.0, 5.0)  # degrees of flexion at base, knuckle 2, knuckle 3

# axial place as (joint it counts from, fraction of the segment that follows): half-width, dorsal, palmar half-height,
# in units of the half-width at knuckle 2
_FINGER_PROFILE = (
    (-1, 0.0, 0.78, 0.70, 0.80),
    (0, 0.0, 1.02, 1.02, 1.04),
    (0, 0.28, 1.05, 0.92, 1.10),
    (0, 0.62, 0.95, 0.83, 1.04),
    (1, 0.0, 1.00, 0.92, 0.88),
    (1, 0.5, 0.88, 0.77, 0.92),
    (2, 0.0, 0.87, 0.73, 0.78),
    (2, 0.35, 0.84, 0.62, 0.85),
    (2, 0.7, 0.78, 0.52, 0.79),
    (2, 1.0, 0.67, 0.44, 0.61),
)

_THUMB_BASE = (22.0, -8.0, 22.0)
_THUMB_LENGTHS = (43.0, 32.0, 27.5)
_THUMB_HALF_WIDTH = 10.4  # at knuckle 3
_THUMB_ABDUCTION = (42.0, 43.0, 49.0)  # of the three segments, from the hand's axis, in the dorsal view
_THUMB_DEPTH = (25.0, 18.0, 12.0)  # towards the palm
_THUMB_ROLL = 65.0
_THUMB_PROFILE = (
    (-1, 0.0, 0.85, 0.75, 0.80),
    (0, 0.0, 1.20, 1.05, 1.25),
    (0, 0.5, 1.22, 1.05, 1.35),
    (1, 0.0, 1.16, 1.14, 1.14),
    (1, 0.5, 0.96, 0.84, 1.00),
    (2, 0.0, 1.00, 0.90, 0.88),
    (2, 0.38, 1.04, 0.72, 0.92),
    (2, 0.7, 0.98, 0.58, 0.86),
    (2, 1.0, 0.84, 0.46, 0.64),
)

# flesh beside the bones, from one place to another: axial fraction, half-width, outer and inner half-height
_THENAR = ((10.0, -9.0, 8.0), (48.0, -24.0, 54.0))
_THENAR_PROFILE = ((0.0, 9.0, 8.0, 8.0), (0.35, 14.0, 12.5, 10.0), (0.7, 13.0, 11.0, 10.0), (1.0, 9.0, 8.0, 8.0))
_BACK = ((17.0, -1.0, 24.0), (33.0, -6.0, 66.0))  # first dorsal interosseous
_BACK_PROFILE = ((0.0, 9.0, 8.0, 9.0), (0.4, 13.0, 8.0, 9.0), (0.75, 11.0, 7.0, 8.0), (1.0, 7.0, 6.0, 7.0))
_WEB = ((24.0, -2.0, 58.0), (44.0, -18.0, 44.0))
_WEB_PROFILE = ((0.0, 17.0, 7.0, 7.0), (0.5, 15.0, 7.0, 8.0), (1.0, 16.0, 8.0, 8.0))


@dataclass(frozen=True, eq=False)
class Digit:
    """Joints of a digit (base, knuckle 2, knuckle 3, tip; shape (4, 3)), its dorsal direction at each, its flesh."""

    joints: Array
    dorsal: Array
    flesh: Sweep


@dataclass(frozen=True, eq=False)
class Plan:
    """Joints [mm] of a left hand and the flesh around its digits; ``stretch`` scales the design's axes."""

    forearm: Array
    wrist: Array
    carpometacarpal: dict[str, Array]
    digits: dict[str, Digit]
    thenar: tuple[Sweep, ...]
    stretch: Array


def plan_hand(along: float, across: float, proportions: Mapping[str, tuple[float, float]]) -> Plan:
    """Lay out a left hand.

    Args:
        along: Scale of distal measures.
        across: Scale of radial and dorsal ones, thicknesses included.
        proportions: Digit → (scale of its length, scale of its thickness).
    """
    stretch = np.array([across, across, along])

    def place(point: tuple[float, float, float]) -> Array:
        return np.array(point) * stretch * (1.0, 1.0, -1.0)

    digits = {}
    for name, finger in _FINGERS.items():
        long, thick = proportions.get(name, (1.0, 1.0))
        turn = np.radians(finger.splay)
        heading = np.array([np.sin(turn), 0.0, -np.cos(turn)])
        lean = np.radians(finger.roll)
        up = _square(np.array([np.sin(lean), np.cos(lean), 0.0]), heading)
        bend = np.radians(np.cumsum(_CURL))
        steps = np.cos(bend)[:, None] * heading - np.sin(bend)[:, None] * up
        digits[name] = _digit(
            place(finger.base), steps, np.array(finger.lengths) * along * long, up,
            finger.half_width * across * thick, _FINGER_PROFILE, 30.0 * along, 0.12,
        )  # fmt: skip
    long, thick = proportions.get("thumb", (1.0, 1.0))
    side, down = np.radians(_THUMB_ABDUCTION), np.radians(_THUMB_DEPTH)
    steps = np.column_stack([np.sin(side) * np.cos(down), -np.sin(down), -np.cos(side) * np.cos(down)])
    mean = steps.sum(axis=0) / np.linalg.norm(steps.sum(axis=0))
    up = _square(np.array([0.0, 1.0, 0.0]), mean)
    roll = np.radians(_THUMB_ROLL)
    up = np.cos(roll) * up + np.sin(roll) * np.cross(up, mean) * np.sign(np.cross(up, mean)[0])
    digits["thumb"] = _digit(
        place(_THUMB_BASE), steps, np.array(_THUMB_LENGTHS) * along * long, up,
        _THUMB_HALF_WIDTH * across * thick, _THUMB_PROFILE, 30.0 * along, 0.1,
    )  # fmt: skip
    return Plan(
        forearm=place(FOREARM),
        wrist=place(WRIST),
        carpometacarpal={name: place(point) for name, point in CARPOMETACARPAL.items()},
        digits=digits,
        thenar=(
            _spindle(place(_THENAR[0]), place(_THENAR[1]), _THENAR_PROFILE, across),
            _spindle(place(_BACK[0]), place(_BACK[1]), _BACK_PROFILE, across),
            _spindle(place(_WEB[0]), place(_WEB[1]), _WEB_PROFILE, across),
        ),
        stretch=stretch,
    )


def _digit(
    base: Array, steps: Array, lengths: Array, up: Array, half: float,
    profile: tuple[tuple[float, ...], ...], root: float, squareness: float,
) -> Digit:  # fmt: skip
    joints = base + np.vstack([np.zeros(3), np.cumsum(steps * lengths[:, None], axis=0)])
    skin = joints[3].copy()
    joints[3] = skin - steps[2] * 0.62 * half  # the extremity's centre lies inside the skin
    axis = (skin - base) / np.linalg.norm(skin - base)
    dorsal = _square(up, axis)
    frame = np.vstack([np.cross(dorsal, axis), dorsal, axis])
    local = (np.vstack([joints[:3], skin]) - base) @ frame.T
    stops = np.concatenate([[-root], local[:, 2]])  # of joint numbers -1, 0, 1, 2, 3
    sizes = [
        (stops[int(j) + 1] + f * (stops[int(j) + 2] - stops[int(j) + 1]), half * w, half * d, half * p)
        for j, f, w, d, p in profile
    ]
    first = local[1] - local[0]
    before = -root * first / first[2]
    flesh = Sweep.through(
        base,
        frame,
        (-root, local[3, 2]),
        (-0.1 * root, stops[3] + 0.62 * (stops[4] - stops[3])),
        squareness,
        [(p[2], p[0], p[1]) for p in (before, *local)],
        sizes,
        (stops[3] + 0.66 * (stops[4] - stops[3]), 0.27 * (stops[4] - stops[3]), 0.62 * half),
    )
    per_joint = np.vstack([_square(dorsal, d) for d in (*steps, steps[2])])
    return Digit(joints, per_joint, flesh)


def _spindle(start: Array, end: Array, profile: tuple[tuple[float, ...], ...], across: float) -> Sweep:
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
    """The part of a vector square to an axis, of length one."""
    out = vector - axis * (vector @ axis) / (axis @ axis)
    return out / np.linalg.norm(out)
