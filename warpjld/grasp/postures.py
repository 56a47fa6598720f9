"""Open hand postures that grasps start from, chosen by the object's proportions (A §10, R90)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.skeleton import CHANNELS, Skeleton

__all__ = ["AHEAD", "CLOSING", "POSTURES", "posture_angles", "posture_for"]

POSTURES: dict[str, dict[str, dict[str, float]]] = {
    # round objects: fingers spread, thumb against the middle finger
    "sphere": {
        "thumb.base": {"pivot": 30, "abduction": 20, "flexion": -10},
        "index.base": {"abduction": 10},
        "ring.base": {"abduction": -8},
        "pinky.base": {"abduction": -18},
    },
    # long objects across the palm: fingers side by side, thumb round the other side
    "cylinder": {
        "thumb.base": {"pivot": 35, "abduction": 10, "flexion": -15},
        "index.base": {"abduction": 5},
        "ring.base": {"abduction": -4},
        "pinky.base": {"abduction": -10},
    },
    # small objects: thumb, index and middle finger only
    "pinch": {
        "thumb.base": {"pivot": 35, "abduction": 15, "flexion": -15},
        "index.base": {"abduction": 3, "flexion": 15},
        "middle.base": {"flexion": 15},
        "ring.base": {"abduction": -6},
        "pinky.base": {"abduction": -14},
    },
    # thin objects: fingers flat on one side, bent at their bases only, thumb on the other
    "plate": {
        "thumb.base": {"pivot": 40, "abduction": 25, "flexion": -15},
        "index.base": {"abduction": 5, "flexion": 25},
        "middle.base": {"flexion": 25},
        "ring.base": {"abduction": -4, "flexion": 25},
        "pinky.base": {"abduction": -10, "flexion": 25},
    },
}
"""Joint angles [degrees] by posture, joint and channel, chosen by hand; joints not named keep their initial angles."""


CLOSING: dict[str, tuple[str, ...]] = {"pinch": ("middle", "index", "thumb")}
"""Digits that close in a posture, for postures in which not all do."""


AHEAD: dict[str, float] = {"pinch": 0.05}
"""Largest distance in front of the palm's centre at which a hand meets the object [m]; 0 where not named."""


def posture_for(size: NDArray[np.float64]) -> str:
    """Name of the posture for an object with these extents [m], shape (3,).

    With sides a ≤ b ≤ c: ``plate`` where a is thinner than a third of b and than 3 cm, ``pinch`` where c is shorter
    than 5 cm, ``cylinder`` where c is longer than 1.6 b, else ``sphere``.
    """
    a, b, c = np.sort(np.asarray(size, dtype=np.float64))
    if a < 0.03 and a < b / 3.0:
        return "plate"
    if c < 0.05:
        return "pinch"
    return "cylinder" if c > 1.6 * b else "sphere"


def posture_angles(skeleton: Skeleton, side: str, posture: str) -> NDArray[np.float64]:
    """Joint angles of a posture [rad], clamped to the joints' limits, shape (J, 4).

    Raises:
        InputError: There is no such posture.
    """
    if posture not in POSTURES:
        raise InputError(f"no posture '{posture}'; there are {', '.join(POSTURES)}")
    angles = skeleton.initial.copy()
    wanted: Mapping[str, Mapping[str, float]] = POSTURES[posture]
    for name, channels in wanted.items():
        joint = f"{side}.{name}"
        if joint in skeleton.names:
            row = skeleton.names.index(joint)
            for channel, degrees in channels.items():
                column = CHANNELS.index(channel)
                angles[row, column] = np.clip(np.radians(degrees), *skeleton.limits[row, column])
    return angles
