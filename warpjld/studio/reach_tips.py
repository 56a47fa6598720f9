"""Inverse kinematics of fingertips and wrists: joint angles within limits, near the present ones, that reach places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.script.scene import Actor
from warpjld.skeleton import CHANNELS, DIGITS, poses_from_angles

__all__ = ["reach_tips", "reach_wrist", "tips"]

_NEAR = 2e-3  # weight of changes of the angles [1/rad], against distances relative to the hand's length
_BEGIN = (0.05, 0.35)
"""Starting points of the searches: distances inside the limits, as fractions of their range."""
_REACHED = 1e-3  # distance that counts as reached, relative to the hand's length
_STEP = 1e-6  # step of the finite differences [rad]


def tips(actor: Actor, side: str) -> dict[str, int]:
    """Joint numbers of the fingertips of one side, by digit."""
    names = actor.skeleton.names
    return {digit: names.index(f"{side}.{digit}.tip") for digit in DIGITS if f"{side}.{digit}.tip" in names}


def reach_tips(
    actor: Actor, side: str, frame: float, targets: Mapping[str, NDArray[np.float64]], *, wrist: bool = False
) -> dict[str, float]:
    """Angles [degrees] by channel with which fingertips come nearest to world positions.

    Args:
        actor: The actor.
        side: ``left`` or ``right``.
        frame: The frame; all other channels keep their angles at it.
        targets: Target positions of the tips by digit [m], shape (3,); digits not named keep their angles.
        wrist: Whether the wrist may move as well.
    """
    ends = tips(actor, side)
    free = _free(actor, side, [*targets], wrist)
    return _reached(actor, frame, {ends[digit]: place for digit, place in targets.items()}, free)


def reach_wrist(actor: Actor, side: str, frame: float, target: NDArray[np.float64]) -> dict[str, float]:
    """Angles [degrees] of the joints above a wrist with which it comes nearest to a world position [m], shape (3,).

    Empty for a hand alone, whose wrist has no joint above it: it is moved as a whole.
    """
    skeleton = actor.skeleton
    wrist = skeleton.names.index(f"{side}.wrist")
    above, joint = [], int(skeleton.parents[wrist])
    while joint >= 0 and skeleton.parents[joint] >= 0:  # the root stays
        above.append(joint)
        joint = int(skeleton.parents[joint])
    columns = range(len(CHANNELS))
    limits = skeleton.limits
    free = [(j, c) for j in reversed(above) for c in columns if limits[j, c, 0] < limits[j, c, 1]]
    return _reached(actor, frame, {wrist: target}, free) if free else {}


def _reached(
    actor: Actor, frame: float, targets: Mapping[int, NDArray[np.float64]], free: Sequence[tuple[int, int]]
) -> dict[str, float]:
    """Angles [degrees] of the free joints and channels that bring joints nearest to world positions [m]."""
    from scipy.optimize import least_squares

    skeleton = actor.skeleton
    base = np.clip(actor.motion.sample([frame], skeleton, limits="clamp")[0][0], *np.moveaxis(skeleton.limits, -1, 0))
    joints, columns = np.array(free, dtype=int).T
    low, high = skeleton.limits[joints, columns].T
    start = np.clip(base[joints, columns], low + 1e-9, high - 1e-9)
    ends, wanted = np.array([*targets]), np.stack([*targets.values()])
    length = float(np.linalg.norm(skeleton.rest[ends] - skeleton.rest[skeleton.parents[joints[0]]], axis=1).max())

    def residuals(values: NDArray[np.float64]) -> NDArray[np.float64]:
        angles = np.repeat(base[None], len(values), axis=0)
        angles[:, joints, columns] = values
        poses = poses_from_angles(skeleton, angles)
        placed = actor.placement.apply(poses, np.full(len(values), frame))
        away = (placed.positions[:, ends] - wanted) / length
        return np.concatenate([away.reshape(len(values), -1), _NEAR * (values - start)], axis=1)

    def slopes(values: NDArray[np.float64]) -> NDArray[np.float64]:
        shifts = _STEP * np.eye(len(values))
        both = residuals(np.concatenate([values + shifts, values - shifts]))
        return np.asarray((both[: len(values)] - both[len(values) :]).T / (2.0 * _STEP))

    # the joints of a straight finger are at their limits, where a local search is stuck: start inside the limits
    best, least = start, float((residuals(start[None]) ** 2).sum()) / 2.0
    for inside in _BEGIN:
        begin = np.clip(start, low + inside * (high - low), high - inside * (high - low))
        solved = least_squares(lambda x: residuals(x[None])[0], begin, jac=slopes, bounds=(low, high), max_nfev=30)
        if solved.cost < least:
            best, least = solved.x, float(solved.cost)
        if np.abs(residuals(best[None])[0, : 3 * len(ends)]).max() < _REACHED:
            break
    degrees = np.degrees(best)
    return {f"{skeleton.names[j]}.{CHANNELS[c]}": float(v) for (j, c), v in zip(free, degrees, strict=True)}


def _free(actor: Actor, side: str, digits: Sequence[str], wrist: bool) -> list[tuple[int, int]]:
    """Joints and channels that may change, parents first."""
    found = []
    for joint, name in enumerate(actor.skeleton.names):
        parts = name.split(".")
        mine = parts[0] == side and (parts[1] in digits or (wrist and parts[1] == "wrist"))
        for column in range(len(CHANNELS)):
            low, high = actor.skeleton.limits[joint, column]
            if mine and low < high and parts[-1] != "carpometacarpal":
                found.append((joint, column))
    return found
