"""Angles of an arm with which a point of its hand comes to a place: inverse kinematics inside the joints' limits.

Seven to nine angles serve three to five wishes, so most targets are reached by many postures. Of those the most
comfortable is taken: the least sum of squares of how far the wrist is bent, the forearm and the upper arm are turned,
the shoulder girdle is drawn along, the upper arm is lifted from where it hangs and swung from where it is (after the
discomfort of Cruse, Biol. Cybern. 54, 1986), and of how deep the arm would lie in the body. It is solved by a
trust-region method with bounds (SciPy's ``least_squares``), from the best of postures spread over the whole range of
the arm, so that neither the pose before nor a singular straight arm decides.
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
"""How deep samples along an arm lie in the body, none below 0: joints (B, K, 3) [m] and rotations (B, K, 4) → depths
(B, samples) [m]."""

_SPREAD = 512
"""Postures the search may begin with."""
_STARTS = 5
"""Of them those it does begin with."""
_STEP = 1e-6  # of differences [rad]
_NEAR = (20.0, 1000.0)
"""Weight of the distance over the arm's length, first and at last: what is comfortable is settled, then the target is
met: comfort moves it by less than 1e-5 of the arm's length."""
_LOOK = 2.0
"""Weight of directions that are wished for, such as where the palm looks, over the sine of the angle that they are off;
those that a grasp prescribes weigh as places do."""
_EXACT = 5.0  # of directions that are prescribed, at first; at last as much more as of places
_DEEP = 50.0  # weight of depths in the body, over the arm's length
# weights of discomfort, over half of the range that clinical tables give
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
"""Weight of how far the shoulder swings from where it is: of two ways to turn it the shorter one is animated."""
_SWINGING = (("shoulder", "flexion"), ("shoulder", "abduction"))
_HANG = 0.4
_OUT = np.radians(15.0)  # between a hanging upper arm and the trunk's plumb line


@dataclass(frozen=True, eq=False)
class Target:
    """What a hand is to come to.

    Attributes:
        place: Where the point is to be [m], shape (3,).
        point: The point, as an offset from the wrist in the wrist's rest axes [m], shape (3,).
        aims: Pairs of a unit direction of the hand at rest and of what it is to be turned to, shapes (3,): none, one
            (the palm looks somewhere), or two (the hand's whole rotation).
        exact: Whether aims are as binding as the place, or give way to what is comfortable.
    """

    place: NDArray[np.float64]
    point: NDArray[np.float64]
    aims: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...] = ()
    exact: bool = False


@dataclass(frozen=True, eq=False)
class Reached:
    """How far an arm came.

    Attributes:
        angles: Of the skeleton [rad], shape (J, 4): of the arm those that were found, of all others those given.
        short: Distance that is left [m].
        off: Largest angle between an aim and where it was to be turned [rad], 0 where there is none.
    """

    angles: NDArray[np.float64]
    short: float
    off: float


def reach(
    arm: Arm, angles: NDArray[np.float64], body: Poses, target: Target, *, depths: Depths | None = None
) -> Reached:
    """The most comfortable posture of an arm with which it comes nearest to a target.

    Args:
        arm: The arm.
        angles: Of the skeleton, whose other joints stay [rad], shape (J, 4).
        body: The pose of these angles on the stage, one frame.
        target: In the stage's frame.
        depths: How deep samples of the arm lie in what they are not to enter.
    """
    from scipy.optimize import least_squares

    costs = _Costs(arm, angles, body, target, depths)
    low, high = arm.limits.T
    best: NDArray[np.float64] | None = None
    least = np.inf
    for start in costs.starts():
        # strictly inside: the method asks for that
        found = np.clip(start, low + 1e-9, high - 1e-9)
        for near in _NEAR:
            solved = least_squares(
                lambda x, near=near: costs(x[None], near)[0],
                found,
                jac=lambda x, near=near: _slopes(lambda some: costs(some, near), x),
                bounds=(low, high),
                xtol=1e-10,
                ftol=1e-10,
                gtol=1e-10,
                max_nfev=100,
            )
            found = np.clip(solved.x, low + 1e-9, high - 1e-9)
        if solved.cost < least:
            least, best = float(solved.cost), np.asarray(solved.x)
    assert best is not None
    return costs.reached(best)


def clear(
    arm: Arm, angles: NDArray[np.float64], body: Poses, values: NDArray[np.float64], depths: Depths
) -> NDArray[np.float64]:
    """Angles of the arm (n,) [rad] nearest to the given ones with which it lies clear of the body.

    Args:
        arm: The arm.
        angles: Of the skeleton, whose other joints stay [rad], shape (J, 4).
        body: One pose that says where the body is.
        values: Those to begin with [rad], shape (n,).
        depths: How deep samples of the arm lie in what they are not to enter.
    """
    from scipy.optimize import least_squares

    low, high = arm.limits.T

    def costs(some: NDArray[np.float64]) -> NDArray[np.float64]:
        positions, rotations = arm.chains(angles, some, body)
        return np.concatenate([some - values, _DEEP * depths(positions, rotations) / arm.length], axis=1)

    start = np.clip(values, low + 1e-9, high - 1e-9)
    solved = least_squares(
        lambda x: costs(x[None])[0], start, jac=lambda x: _slopes(costs, x), bounds=(low, high), max_nfev=100
    )
    return np.asarray(solved.x)


class _Costs:
    """Residuals of postures; args as of ``reach``."""

    def __init__(
        self, arm: Arm, angles: NDArray[np.float64], body: Poses, target: Target, depths: Depths | None
    ) -> None:
        self._arm, self._angles, self._body, self._target, self._depths = arm, angles, body, target, depths
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
        out = [near * away / arm.length, _HANG * (upper - self._hang), self._weights * values]
        out.append(self._swing * (values - self._now))
        weight = near / _NEAR[0] * _EXACT if target.exact else _LOOK
        out += [weight * (rotate(rotations[:, -1], own) - wanted) for own, wanted in target.aims]
        if self._depths is not None:
            out.append(_DEEP * self._depths(positions, rotations) / arm.length)
        return np.concatenate(out, axis=1)

    def starts(self) -> NDArray[np.float64]:
        """The best of postures spread evenly over the arm's range, shape (S, n)."""
        from scipy.stats import qmc

        low, high = self._arm.limits.T
        spread = low + qmc.Sobol(len(low), scramble=False).random(_SPREAD) * (high - low)
        order = np.argsort((self(spread, _NEAR[0]) ** 2).sum(axis=1), kind="stable")
        return np.asarray(spread[order[:_STARTS]])

    def reached(self, x: NDArray[np.float64]) -> Reached:
        """What a posture comes to."""
        target = self._target
        positions, rotations = self._arm.chains(self._angles, x[None], self._body)
        away = positions[0, -1] + rotate(rotations[0, -1], target.point) - target.place
        cosines = [float(rotate(rotations[0, -1], own) @ wanted) for own, wanted in target.aims]
        off = float(np.arccos(np.clip(min(cosines, default=1.0), -1.0, 1.0)))
        return Reached(self._arm.posed(self._angles, x), float(np.linalg.norm(away)), off)


def _slopes(
    residuals: Callable[[NDArray[np.float64]], NDArray[np.float64]], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Derivatives (R, n) of residuals, of B postures (B, n) → (B, R), by central differences, all in one batch."""
    shifts = _STEP * np.eye(len(x))
    both = residuals(np.concatenate([x + shifts, x - shifts]))
    return np.asarray((both[: len(x)] - both[len(x) :]).T / (2.0 * _STEP))


def _hanging(arm: Arm, body: Poses) -> NDArray[np.float64]:
    """Direction of an upper arm that hangs at the side of the trunk as it stands, shape (3,)."""
    skeleton = arm.skeleton
    shoulder = skeleton.names[arm.joints[arm.shoulder]]
    side = shoulder.partition(".")[0]
    other = f"{'right' if side == 'left' else 'left'}.shoulder"
    rest = skeleton.rest
    # from the middle of the trunk's root up to the girdle, and out to this side, as the body stands at rest
    root = int(np.flatnonzero(skeleton.parents < 0)[0])
    up = unit(rest[arm.base] - rest[root]) if arm.base != root else np.array([0.0, 1.0, 0.0])
    middle = rest[skeleton.names.index(other)] if other in skeleton.names else rest[arm.base]
    out = rest[arm.joints[arm.shoulder]] - middle
    out = unit(out - up * (out @ up))
    hanging = np.sin(_OUT) * out - np.cos(_OUT) * up
    return np.asarray(rotate(body.rotations[0, arm.base], hanging))
