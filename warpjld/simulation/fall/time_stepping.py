"""Time integration of rigid bodies with contact and friction, without restitution (semi-implicit Euler steps).

Without contact the centre of mass follows the exact parabola. In contact a body does not bounce, sticks or slides by
Coulomb's law, and its spin is damped by a rolling resistance α I ω, which models losses of flesh and rubber. Energy
never increases unless an animated obstacle pushes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.obstacle import Rigid
from warpjld.simulation.fall.contact_points import ContactCandidates, RigidContact, contacts_with, contacts_within
from warpjld.simulation.fall.impulses import impulses, jacobian
from warpjld.simulation.fall.rigid_body import RigidBody

__all__ = ["ROLLING", "coast", "step_bodies", "steps_of"]

ROLLING = 20.0
"""Rolling resistance α: decay rate of the spin of a body in contact [1/s]."""

_LONGEST = 1.0 / 240.0
"""Longest time step [s]."""
_NEAR = 1e-3
"""Smallest search margin for contacts [m]; the distance that bodies move in two steps is added."""
_PARTED = 0.2
"""Fraction of an overlap that is corrected per step."""
_SLOP = 1e-5
"""Gap at which bodies come to rest [m], so that the deformable contact solve starts without overlap."""
_MISSED, _ROUNDS = 1e-6, 20
"""Overlap by the end of a step from which a near point is added to those that impulses are found for [m], and most
rounds of that. On curved skin a plate is borne by points that are not the outermost: without them it fell by a
tenth of a millimetre whenever one of them was left out, and never came to rest."""


def steps_of(frames: float, rate: float) -> int:
    """Number of time steps for an interval in frames at a frame rate [1/s]."""
    return max(1, int(np.ceil(frames / rate / _LONGEST - 1e-9)))


def coast(body: RigidBody, gravity: NDArray[np.float64], seconds: float) -> None:
    """Advance a body without contact, in place, under the acceleration ``gravity`` (3,) [m/s²]."""
    body.centre = body.centre + seconds * body.velocity + 0.5 * seconds**2 * gravity
    body.velocity = body.velocity + seconds * gravity
    body.turn = Rotation.from_rotvec(seconds * body.spin).as_matrix() @ body.turn


def step_bodies(
    bodies: Sequence[RigidBody],
    obstacles: Mapping[str, Obstacle],
    gravity: NDArray[np.float64],
    friction: Callable[[str, str], float],
    *,
    time: float,
    step: float,
    length: float,
    load: Callable[[RigidBody], NDArray[np.float64]] | None = None,
) -> list[RigidContact]:
    """Advance bodies by one time step, in place.

    Args:
        bodies: All free bodies.
        obstacles: Animated obstacles by name.
        gravity: Acceleration [m/s²], shape (3,).
        friction: Coulomb's μ between two names.
        time: Time at the begin of the step [frames].
        step: Length of the step [frames].
        length: The same [s].
        load: External force [N] and moment about the centre of mass [N m] on a body, shape (6,); None: none.

    Returns:
        Contacts with a normal impulse.
    """
    gains = []
    for one in bodies:
        pushed = np.zeros(6) if load is None else load(one)
        gains.append(gravity + pushed[:3] / one.shape.mass)
        one.velocity = one.velocity + length * gains[-1]
        inertia = one.turn @ one.shape.inertia @ one.turn.T
        one.spin = one.spin + length * one.inverse @ (pushed[3:] - np.cross(one.spin, inertia @ one.spin))
        if one.touching:
            one.spin = one.spin / (1.0 + ROLLING * length)
    margins = [_NEAR + 2.0 * length * one.speed for one in bodies]
    near = contacts_within(bodies, max(margins, default=0.0), friction)
    shapes = {name: _shape(obstacle, time) for name, obstacle in obstacles.items()}
    for k, one in enumerate(bodies):
        for part in one.parts:
            near += contacts_with(k, part, obstacles, time, step, length, margins[k], friction, shapes)
    pressed, parting = _impelled(bodies, near, length)
    for k, one in enumerate(bodies):
        mine = [c for c in pressed if k in (c.body, c.other)]
        names = [c.name if c.body == k else c.own for c in mine]
        one.touching = tuple(dict.fromkeys(names))
        signs = (1.0 if c.body == k else -1.0 for c in mine)
        upward = [sign * float(c.normal @ gravity) < 0.0 for sign, c in zip(signs, mine, strict=True)]
        one.bearers = tuple(dict.fromkeys(name for name, up in zip(names, upward, strict=True) if up)) or one.touching
        moved = length * (one.velocity + parting[k, :3])
        if not mine:
            moved = moved - 0.5 * length**2 * gains[k]
        one.centre = one.centre + moved
        one.turn = Rotation.from_rotvec(length * (one.spin + parting[k, 3:])).as_matrix() @ one.turn
    return pressed


_shapes: WeakKeyDictionary[Obstacle, NDArray[np.float64]] = WeakKeyDictionary()
"""Cache of the surface points of rigid obstacles at time 0, which take as long to make as a time step."""


def _shape(obstacle: Obstacle, time: float) -> NDArray[np.float64]:
    """Surface points of an obstacle at a time [m], shape (n, 3)."""
    if not isinstance(obstacle, Rigid):
        return np.asarray(obstacle.mesh(time)[0], np.float64)
    if obstacle not in _shapes:
        _shapes[obstacle] = np.asarray(obstacle.mesh(0.0)[0], np.float64)
    return np.asarray(obstacle.carried(_shapes[obstacle], 0.0, time))


def _impelled(
    bodies: Sequence[RigidBody], near: Sequence[ContactCandidates], length: float
) -> tuple[list[RigidContact], NDArray[np.float64]]:
    """Apply contact impulses to the velocities of bodies.

    Returns:
        Contacts with a normal impulse, and pseudo-velocities that reduce overlaps, which change positions but not the
        bodies' velocities, shape (B, 6) [m/s, rad/s].
    """
    parting = np.zeros((len(bodies), 6))
    rows = [list(one.outermost) for one in near]
    if not any(rows):
        return [], parting
    velocity = np.concatenate([np.concatenate([one.velocity, one.spin]) for one in bodies])
    inverse = _inverses(bodies)
    for _ in range(_ROUNDS):
        contacts = [one.contact(row) for one, mine in zip(near, rows, strict=True) for row in mine]
        relative = jacobian(bodies, contacts)
        moves = inverse @ relative.T
        delassus = relative @ moves
        free = relative @ velocity - np.concatenate([c.axes @ c.carried for c in contacts])
        gaps = np.array([c.gap - _SLOP for c in contacts])
        friction = np.array([c.friction for c in contacts])
        found = impulses(delassus, free, np.maximum(gaps, 0.0) / length, friction)
        for one, after in zip(bodies, (velocity + moves @ found).reshape(-1, 6), strict=True):
            one.velocity, one.spin = after[:3], after[3:]
        if not _added(bodies, near, rows, length):
            break
    if (gaps < 0.0).any():
        corrections = impulses(delassus, np.zeros(3 * len(gaps)), _PARTED * gaps / length, np.zeros(len(gaps)))
        parting = (moves @ corrections).reshape(-1, 6)
    known = zip(contacts, found[::3], free[::3], strict=True)
    pressed = [replace(c, closing=-float(v)) for c, p, v in known if p > 0.0]
    return pressed, parting


def _inverses(bodies: Sequence[RigidBody]) -> NDArray[np.float64]:
    """Inverse masses and inertia tensors of all bodies, shape (6B, 6B)."""
    out = np.zeros((6 * len(bodies), 6 * len(bodies)))
    for k, one in enumerate(bodies):
        out[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = np.eye(3) / one.shape.mass
        out[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = one.inverse
    return out


def _added(
    bodies: Sequence[RigidBody], near: Sequence[ContactCandidates], rows: Sequence[list[int]], length: float
) -> bool:
    """Add to ``rows`` of each pair the point that would overlap most at the end of the step; False if none would."""
    out = False
    for one, mine in zip(near, rows, strict=True):
        overlap = -np.maximum(one.gaps - _SLOP, 0.0) - length * one.parting(bodies)
        overlap[mine] = 0.0
        worst = int(np.argmax(overlap))
        if overlap[worst] > _MISSED:
            mine.append(worst)
            out = True
    return out
