"""Random placement of a hand beside an object: draw an approach, and place the palm there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.grasp.near_object import NearObject
from warpjld.grasp.palm import Palm
from warpjld.study.grasping.plan import WristRange

__all__ = ["Approach", "backed_off", "draw_approach", "place_palm"]

Array = NDArray[np.float64]

_CLEAR = 5e-4  # the open hand starts at least this far from the object [m]
_ROUNDING = 1e-5  # more than float32 loses of a distance [m]
_BACKED_OFF = 0.25  # largest distance by which the hand is moved back [m]


@dataclass(frozen=True, eq=False)
class Approach:
    """A random approach, in the object's frame.

    Attributes:
        direction: Unit vector from the object towards the approaching hand, shape (3,).
        aim: Point in the object that the palm aims at [m], shape (3,).
        fingers: Unit direction of the fingers, perpendicular to ``direction``, shape (3,).
        tilt: Angle between the palm's normal and the approach [rad].
        about: Angle of the tilt's axis, from ``fingers`` about ``direction`` [rad].
        gap: Distance left between palm and object along the approach [m].
    """

    direction: Array
    aim: Array
    fingers: Array
    tilt: float
    about: float
    gap: float


def draw_approach(ranges: WristRange, rng: np.random.Generator, extent: Array) -> Approach:
    """Draw an approach; always consumes the same number of random numbers.

    Args:
        ranges: Ranges of the plan.
        rng: Source of random numbers.
        extent: Extent of the object along its axes [m], shape (3,), with its centre at the origin.
    """
    low, high = np.sin(np.radians(ranges.elevation))
    height = rng.uniform(low, high)
    azimuth, roll = (np.radians(rng.uniform(*span)) for span in (ranges.azimuth, ranges.roll))
    flat = np.sqrt(max(0.0, 1.0 - height**2))
    direction = np.array([flat * np.sin(azimuth), height, flat * np.cos(azimuth)])
    tilt, about = np.radians(rng.uniform(*ranges.tilt)), rng.uniform(-np.pi, np.pi)
    gap = rng.uniform(*ranges.gap)
    aside = rng.normal(size=3)
    aside *= rng.uniform(*ranges.offset) / np.linalg.norm(aside)
    # fingers horizontal, then rolled about the approach
    level = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
    fingers = Rotation.from_rotvec(roll * direction).apply(level)
    return Approach(direction, aside * extent / 2.0, fingers, float(tilt), float(about), float(gap))


def place_palm(palm: Palm, approach: Approach, point: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) [m] that place a palm at a point, facing the object with the tilt."""
    across = np.cross(approach.direction, approach.fingers)
    axis = np.cos(approach.about) * approach.fingers + np.sin(approach.about) * across
    turn = Rotation.from_rotvec(approach.tilt * axis).as_matrix() @ palm.turned_to(
        -approach.direction, approach.fingers
    )
    return turn, point - turn @ palm.middle


def backed_off(opened: Array, near: NearObject, turn: Array, shift: Array, approach: Approach) -> float | None:
    """How far the open hand must be moved back until it is clear of the object [m]; None if too far."""
    placed, back = opened @ turn.T + shift, 0.0
    skin = placed[near.met(placed, approach.direction, _CLEAR + _ROUNDING)]
    if not len(skin):
        return back
    while back <= _BACKED_OFF:
        nearest = float(near.least((skin + back * approach.direction)[None])[0])
        if nearest >= _CLEAR:
            return back
        # lower bound of the further distance: the object penetrates the hand by this depth
        back += max(_CLEAR - nearest, 1e-4)
    return None
