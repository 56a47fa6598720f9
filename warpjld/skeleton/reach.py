"""Inverse kinematics of an arm: joint angles within limits that bring a point of the hand to a target.

Seven to nine angles meet three to five constraints, so most targets are reached by many postures. The most comfortable
one is taken: the least sum of squares of wrist bending, forearm and upper arm twist, girdle motion, deviation of the
upper arm from hanging and its swing from the present pose (after the discomfort of Cruse, Biol. Cybern. 54, 1986), and
of penetration of the body. It is solved by a trust-region method with bounds (SciPy's ``least_squares``), started from
the best of samples of the arm's whole range, so that the result depends neither on a local minimum near the present
pose nor on a singular straight arm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import rotate, unit
from warpjld.skeleton.arm import Arm
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import CHANNELS

__all__ = ["Reached", "Target", "clear", "reach"]

Depths = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""Penetration depths of samples along an arm in the body, at least 0: joints (B, K, 3) [m] and rotations (B, K, 4) →
depths (B, samples) [m]."""

_SAMPLES = 512
"""Postures sampled as candidates for starts."""
_STARTS = 5
"""Best samples from which the search is started."""
_KEPT = 2
"""Of these as many are solved to the end: comfort, by which they are ranked, hardly changes then."""
_FIRST, _LAST = 50, 100  # largest numbers of evaluations of the first and the last solve
_STEP = 1e-6  # of central differences [rad]
_DISTANCE_WEIGHTS = (20.0, 1000.0)
"""Weights of the distance to the target over the arm's length, of the first and the last solve: the first settles the
comfort terms, the last meets the target; comfort moves it by less than 1e-5 of the arm's length."""
_PREFERRED = 2.0
"""Weight of preferred directions (such as that of the palm), over the sine of their deviation; prescribed ones weigh as
positions do."""
_PRESCRIBED = 5.0  # weight of prescribed directions in the first solve; scaled as that of the distance in the last
_PENETRATION = 50.0  # weight of penetration depths, over the arm's length
_FIRM = 20.0
"""Weight of penetration depths per weight of the distance, where they come first: of what the target is missed by, a
400th part enters the body."""
# weights of discomfort, over half of the clinical range of motion
_DISCOMFORT = {
    ("wrist", "flexion"): 0.5 / np.radians(75.0),
    ("wrist", "abduction"): 0.5 / np.radians(25.0),
    ("elbow", "flexion"): 0.1 / np.radians(75.0),
    ("elbow", "twisting"): 0.3 / np.radians(80.0),
    ("shoulder", "twisting"): 0.3 / np.radians(80.0),
    ("clavicle", "flexion"): 0.8 / np.radians(20.0),
    ("clavicle", "abduction"): 0.8 / np.radians(20.0),
}
_SWING = 0.2 / np.radians(90.0)
"""Weight of the shoulder's swing from the present pose: of two ways to turn it the shorter one is taken."""
_SWINGING = (("shoulder", "flexion"), ("shoulder", "abduction"))
_HANGING = 0.4  # weight of the upper arm's deviation from hanging
_HANGING_ANGLE = np.radians(15.0)  # between a hanging upper arm and the vertical of the trunk


@dataclass(frozen=True, eq=False)
class Target:
    """Target of a hand.

    Attributes:
        place: Target position of the point [m], shape (3,).
        point: The point, as an offset from the wrist in the wrist's rest axes [m], shape (3,).
        aims: Pairs of a unit direction of the hand at rest and its target direction, shapes (3,): none, one (of the
            palm), or two (the hand's whole rotation).
        exact: Whether aims are as binding as the position, or yield to comfort.
    """

    place: NDArray[np.float64]
    point: NDArray[np.float64]
    aims: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...] = ()
    exact: bool = False


@dataclass(frozen=True, eq=False)
class Reached:
    """Posture found by :func:`reach` and its errors.

    Attributes:
        angles: The skeleton's angles [rad], shape (J, 4): those of the arm replaced by the ones found.
        short: Remaining distance to the target [m].
        off: Largest angle between an aim and its target direction [rad], 0 without aims.
    """

    angles: NDArray[np.float64]
    short: float
    off: float


def reach(
    arm: Arm,
    angles: NDArray[np.float64],
    body: Poses,
    target: Target,
    *,
    depths: Depths | None = None,
    start: NDArray[np.float64] | None = None,
    firm: bool = False,
) -> Reached:
    """The most comfortable posture of an arm that comes nearest to a target.

    Args:
        arm: The arm.
        angles: The skeleton's angles; those of other joints are kept [rad], shape (J, 4).
        body: Pose of these angles in the scene, one frame.
        target: Target in the scene's frame.
        depths: Penetration depths of samples of the arm in what it must not enter.
        start: Angles of the arm near the solution, as of a target close by [rad], shape (n,); by default the search is
            started from several samples of the arm's range.
        firm: Whether not to penetrate the body comes before the target; otherwise the target comes first.
    """
    from scipy.optimize import least_squares

    costs = _Residuals(arm, angles, body, target, depths, firm)
    low, high = arm.limits.T

    def solved(first: NDArray[np.float64], near: float, most: int) -> tuple[float, NDArray[np.float64]]:
        # strictly inside the bounds, as least_squares requires
        found = least_squares(
            lambda x: costs(x[None], near)[0],
            np.clip(first, low + 1e-9, high - 1e-9),
            jac=lambda x: _jacobian(lambda postures: costs(postures, near), x),
            bounds=(low, high),
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-10,
            max_nfev=most,
        )
        return float(found.cost), np.asarray(found.x)

    starts = costs.starts() if start is None else start[None]
    settled = sorted((solved(first, _DISTANCE_WEIGHTS[0], _FIRST) for first in starts), key=lambda one: one[0])
    _, best = min((solved(x, _DISTANCE_WEIGHTS[1], _LAST) for _, x in settled[:_KEPT]), key=lambda one: one[0])
    return costs.reached(best)


def clear(
    arm: Arm, angles: NDArray[np.float64], body: Poses, values: NDArray[np.float64], depths: Depths
) -> NDArray[np.float64]:
    """Angles of the arm (n,) [rad] nearest to the given ones at which it does not penetrate the body.

    Args:
        arm: The arm.
        angles: The skeleton's angles; those of other joints are kept [rad], shape (J, 4).
        body: A single pose that places the body.
        values: Angles of the arm to start from [rad], shape (n,).
        depths: Penetration depths of samples of the arm in what it must not enter.
    """
    from scipy.optimize import least_squares

    low, high = arm.limits.T

    def costs(postures: NDArray[np.float64]) -> NDArray[np.float64]:
        positions, rotations = arm.chains(angles, postures, body)
        return np.concatenate([postures - values, _PENETRATION * depths(positions, rotations) / arm.length], axis=1)

    start = np.clip(values, low + 1e-9, high - 1e-9)
    solved = least_squares(
        lambda x: costs(x[None])[0], start, jac=lambda x: _jacobian(costs, x), bounds=(low, high), max_nfev=100
    )
    return np.asarray(solved.x)


class _Residuals:
    """Residuals of postures; arguments as of ``reach``."""

    def __init__(
        self,
        arm: Arm,
        angles: NDArray[np.float64],
        body: Poses,
        target: Target,
        depths: Depths | None,
        firm: bool,
    ) -> None:
        self._arm, self._angles, self._body, self._target, self._depths = arm, angles, body, target, depths
        self._firm = firm
        names = [arm.skeleton.names[j].rpartition(".")[2] for j in arm.joints]
        words = [(names[k], CHANNELS[column]) for k, column in arm.free.tolist()]
        self._weights = np.array([_DISCOMFORT.get(word, 0.0) for word in words])
        self._swing = np.array([_SWING if word in _SWINGING else 0.0 for word in words])
        self._now = arm.values(angles)
        self._hang = _hanging(arm, body)

    def __call__(self, values: NDArray[np.float64], near: float) -> NDArray[np.float64]:
        """Residuals (B, R) of B postures (B, n)."""
        arm, target = self._arm, self._target
        positions, rotations = arm.chains(self._angles, values, self._body)
        away = positions[:, -1] + rotate(rotations[:, -1], target.point) - target.place
        upper = unit(positions[:, arm.elbow] - positions[:, arm.shoulder])
        out = [near * away / arm.length, _HANGING * (upper - self._hang), self._weights * values]
        out.append(self._swing * (values - self._now))
        weight = near / _DISTANCE_WEIGHTS[0] * _PRESCRIBED if target.exact else _PREFERRED
        out += [weight * (rotate(rotations[:, -1], own) - wanted) for own, wanted in target.aims]
        if self._depths is not None:
            weight = _FIRM * near if self._firm else _PENETRATION
            out.append(weight * self._depths(positions, rotations) / arm.length)
        return np.concatenate(out, axis=1)

    def starts(self) -> NDArray[np.float64]:
        """The best of a low-discrepancy sample of the arm's range, shape (S, n)."""
        from scipy.stats import qmc

        low, high = self._arm.limits.T
        spread = low + qmc.Sobol(len(low), scramble=False).random(_SAMPLES) * (high - low)
        order = np.argsort((self(spread, _DISTANCE_WEIGHTS[0]) ** 2).sum(axis=1), kind="stable")
        return np.asarray(spread[order[:_STARTS]])

    def reached(self, x: NDArray[np.float64]) -> Reached:
        """Result of a posture (n,), with its errors."""
        target = self._target
        positions, rotations = self._arm.chains(self._angles, x[None], self._body)
        away = positions[0, -1] + rotate(rotations[0, -1], target.point) - target.place
        cosines = [float(rotate(rotations[0, -1], own) @ wanted) for own, wanted in target.aims]
        off = float(np.arccos(np.clip(min(cosines, default=1.0), -1.0, 1.0)))
        return Reached(self._arm.posed(self._angles, x), float(np.linalg.norm(away)), off)


def _jacobian(
    residuals: Callable[[NDArray[np.float64]], NDArray[np.float64]], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Jacobian (R, n) of residuals (B, n) → (B, R), by central differences evaluated in one batch."""
    shifts = _STEP * np.eye(len(x))
    both = residuals(np.concatenate([x + shifts, x - shifts]))
    return np.asarray((both[: len(x)] - both[len(x) :]).T / (2.0 * _STEP))


def _hanging(arm: Arm, body: Poses) -> NDArray[np.float64]:
    """Direction of the upper arm when it hangs beside the trunk in the present pose, shape (3,)."""
    skeleton = arm.skeleton
    shoulder = skeleton.names[arm.joints[arm.shoulder]]
    side = shoulder.partition(".")[0]
    other = f"{'right' if side == 'left' else 'left'}.shoulder"
    rest = skeleton.rest
    # up from the root of the trunk to the girdle, and outwards to this side, in the rest pose
    root = int(np.flatnonzero(skeleton.parents < 0)[0])
    up = unit(rest[arm.base] - rest[root]) if arm.base != root else np.array([0.0, 1.0, 0.0])
    middle = rest[skeleton.names.index(other)] if other in skeleton.names else rest[arm.base]
    out = rest[arm.joints[arm.shoulder]] - middle
    out = unit(out - up * (out @ up))
    hanging = np.sin(_HANGING_ANGLE) * out - np.cos(_HANGING_ANGLE) * up
    return np.asarray(rotate(body.rotations[0, arm.base], hanging))
