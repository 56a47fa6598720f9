"""A posture on the way of an arm, by which it goes around the body instead of through it.

A motion between two postures that both clear the body may pass through it. Sampling-based planning (as of probabilistic
roadmaps: Kavraki et al., IEEE Trans. Robotics and Automation 12, 1996) with a single posture between suffices for an
arm: from a low-discrepancy sample of its range those are taken to which, and from which, the straight ways in the space
of angles penetrate the body least, and of these the ones with the shortest way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.arm import Arm
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.reach import Depths

__all__ = ["postures_between"]

_SAMPLES = 512  # postures that are tried
_SHORTEST = 96  # of these, as many with the shortest ways are looked at along their ways
_STEPS = 10  # postures on each half of a way
_FAR = 0.02
"""Root of the mean square of penetration along a way, per length of the arm, that weighs as much as a way longer by
one radian: a clear way is preferred to any shorter one that is not."""


def postures_between(
    arm: Arm,
    angles: NDArray[np.float64],
    body: Poses,
    first: NDArray[np.float64],
    last: NDArray[np.float64],
    depths: Depths,
    count: int,
) -> list[NDArray[np.float64]]:
    """Postures between two others by which an arm penetrates the body least, the best first.

    Args:
        arm: The arm.
        angles: The skeleton's angles; those of other joints are kept [rad], shape (J, 4).
        body: A single pose that places the body.
        first: Angles of the arm at the beginning of its way [rad], shape (n,).
        last: Likewise at its end.
        depths: Penetration depths of samples along the arm in what it must not enter.
        count: Number of postures.

    Returns:
        Angles of the arm [rad], shape (n,), at most ``count`` of them.
    """
    from scipy.stats import qmc

    low, high = arm.limits.T
    between = low + qmc.Sobol(len(low), scramble=False).random(_SAMPLES) * (high - low)
    # the sample's middle is far from short ways: half of each posture is the way's own middle
    between = np.concatenate([between, 0.5 * (between + 0.5 * (first + last))])
    between = between[_penetration(arm, angles, body, between[:, None], depths) == 0.0]
    length = np.linalg.norm(between - first, axis=1) + np.linalg.norm(last - between, axis=1)
    kept = np.argsort(length, kind="stable")[:_SHORTEST]
    between, length = between[kept], length[kept]
    share = np.arange(1, _STEPS + 1)[:, None] / _STEPS
    there = first + share * (between[:, None] - first)
    back = between[:, None] + share * (last - between[:, None])
    ways = np.concatenate([there, back[:, :-1]], axis=1)
    cost = length + _penetration(arm, angles, body, ways, depths) / (_FAR * arm.length)
    return list(between[np.argsort(cost, kind="stable")[:count]])


def _penetration(
    arm: Arm, angles: NDArray[np.float64], body: Poses, ways: NDArray[np.float64], depths: Depths
) -> NDArray[np.float64]:
    """Root of the mean square, over the postures of each way (B, S, n), of the sum of penetration depths [m], (B,)."""
    count, steps, free = ways.shape
    positions, rotations = arm.chains(angles, ways.reshape(-1, free), body)
    summed = depths(positions, rotations).sum(axis=1).reshape(count, steps)
    return np.asarray(np.sqrt((summed**2).mean(axis=1)))
