"""Digits that do not come to the object however far they may bend on, and how far short of it they stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.digits import digit_chains
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.channels import FLEXION
from warpjld.study.grasping.load import Hand, Thing

__all__ = ["digits_short_of"]

Array = NDArray[np.float64]

_STEP = np.radians(1.0)
"""Interval of the closings that are looked at [rad]: a fingertip moves by 1.5 mm."""
_TOUCHES = 1e-4
"""Gap below which a digit touches [m], as where hands close (``Closed.touching``)."""


def digits_short_of(
    hand: Hand, thing: Thing, angles: Array, position: Array, rotation: Array, *, most: float
) -> dict[str, float]:
    """Smallest gap to the object of each digit that does not touch it, while its joints bend on together.

    The skin is that without contact: flesh that is pressed only recedes, so that what it does not reach is not reached.

    Args:
        hand: The hand.
        thing: The object, in its own frame.
        angles: Angles of the closed hand [rad], shape (J, 4).
        position: Displacement of the root from rest [m], shape (3,).
        rotation: Rotation of the root about its rest position, quaternion x, y, z, w.
        most: Largest further flexion of each joint [rad].

    Returns:
        Gaps [m] by digit, such as ``pinky``; only those that do not come within 0.1 mm.
    """
    skeleton, chains = hand.rig.skeleton, digit_chains(hand.rig.skeleton)
    ways = np.linspace(0.0, most, 1 + max(1, int(np.ceil(most / _STEP))))
    bent = np.repeat(angles[None], len(ways), axis=0)
    for joints in map(list, chains.values()):
        now = angles[joints, FLEXION]
        high = np.maximum(skeleton.limits[joints, FLEXION, 1], now)
        bent[:, joints, FLEXION] = np.minimum(now + ways[:, None], high)
    root = {"root_position": position, "root_rotation": rotation}
    poses = poses_from_angles(skeleton, bent, **{name: np.tile(one, (len(ways), 1)) for name, one in root.items()})
    both = HandObjectGaps(hand.covering, thing.body, thing.near)
    gaps = both.gaps(hand.covering.deform(poses, threads=1)).min(axis=0)
    least = {name.rpartition(".")[2]: float(gaps[both.parts.index(name)]) for name in chains if name in both.parts}
    return {digit: gap for digit, gap in least.items() if gap > _TOUCHES}
