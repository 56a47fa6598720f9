"""Rigid bodies through time: implicit Euler steps with contact and friction, without restitution.

In the air a body moves exactly as a parabola has it. What touches lands without bouncing, sticks or slides by Coulomb's
law, and loses spin: rolling resistance α I ω, what flesh and rubber lose where they are rolled on. Nothing else is
lost or gained: energy never rises unless what moves by its animation pushes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.obstacle import Rigid
from warpjld.simulation.fall.contact_points import RigidContact, contacts_with, contacts_within
from warpjld.simulation.fall.impulses import impulses, jacobian
from warpjld.simulation.fall.rigid_body import RigidBody

__all__ = ["ROLLING", "step_bodies", "steps_of"]

ROLLING = 20.0
"""α: share of its spin that a touching body loses in a second, about [1/s]."""

_LONGEST = 1.0 / 240.0
"""Length of a step at most [s]."""
_NEAR = 1e-3
"""Contacts are looked for nearer than this [m], and as far as bodies go in two steps."""
_PARTED = 0.2
"""Share of an overlap that a step takes away."""
_SLOP = 1e-5
"""Gap at which bodies rest [m]: contact of deformable ones begins from bodies that do not overlap."""


def steps_of(frames: float, rate: float) -> int:
    """Steps for some frames of a scene with that rate [1/s]."""
    return max(1, int(np.ceil(frames / rate / _LONGEST - 1e-9)))


def step_bodies(
    bodies: Sequence[RigidBody],
    obstacles: Mapping[str, Obstacle],
    gravity: NDArray[np.float64],
    friction: Callable[[str, str], float],
    *,
    time: float,
    step: float,
    length: float,
) -> list[RigidContact]:
    """Move bodies on by a step, in place; the contacts that pressed.

    Args:
        bodies: All that are free.
        obstacles: What moves by its animation, by name.
        gravity: [m/s²], shape (3,).
        friction: Between two names.
        time: The obstacles', at the beginning [frames].
        step: [frames].
        length: The same [s].
    """
    for one in bodies:
        one.velocity = one.velocity + length * gravity
        inertia = one.turn @ one.shape.inertia @ one.turn.T
        one.spin = one.spin - length * one.inverse @ np.cross(one.spin, inertia @ one.spin)
        if one.touching:
            one.spin = one.spin / (1.0 + ROLLING * length)
    margins = [_NEAR + 2.0 * length * one.speed for one in bodies]
    contacts = contacts_within(bodies, max(margins, default=0.0), friction)
    shapes = {name: _shape(obstacle, time) for name, obstacle in obstacles.items()}
    for k, one in enumerate(bodies):
        contacts += contacts_with(k, one, obstacles, time, step, length, margins[k], friction, shapes)
    pressed, parting = _impelled(bodies, contacts, length)
    for k, one in enumerate(bodies):
        mine = [c for c in pressed if k in (c.body, c.other)]
        names = [c.name if c.body == k else bodies[c.body].shape.name for c in mine]
        one.touching = tuple(dict.fromkeys(names))
        moved = length * (one.velocity + parting[k, :3])
        if not mine:
            moved = moved - 0.5 * length**2 * gravity
        one.centre = one.centre + moved
        one.turn = Rotation.from_rotvec(length * (one.spin + parting[k, 3:])).as_matrix() @ one.turn
    return pressed


_shapes: WeakKeyDictionary[Obstacle, NDArray[np.float64]] = WeakKeyDictionary()
"""Points of rigid obstacles at time 0: making them takes as long as a step does."""


def _shape(obstacle: Obstacle, time: float) -> NDArray[np.float64]:
    """Points of an obstacle's surface at a time [m], shape (n, 3)."""
    if not isinstance(obstacle, Rigid):
        return np.asarray(obstacle.mesh(time)[0], np.float64)
    if obstacle not in _shapes:
        _shapes[obstacle] = np.asarray(obstacle.mesh(0.0)[0], np.float64)
    return np.asarray(obstacle.carried(_shapes[obstacle], 0.0, time))


def _impelled(
    bodies: Sequence[RigidBody], contacts: Sequence[RigidContact], length: float
) -> tuple[list[RigidContact], NDArray[np.float64]]:
    """Give bodies the velocities after contact; those that press, and what else parts overlaps (B, 6) [m/s, rad/s]."""
    parting = np.zeros((len(bodies), 6))
    if not contacts:
        return [], parting
    rows = jacobian(bodies, contacts)
    inverse = np.zeros((6 * len(bodies), 6 * len(bodies)))
    for k, one in enumerate(bodies):
        inverse[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = np.eye(3) / one.shape.mass
        inverse[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = one.inverse
    moves = inverse @ rows.T
    delassus = rows @ moves
    velocity = np.concatenate([np.concatenate([one.velocity, one.spin]) for one in bodies])
    carried = np.concatenate([_axes(c) @ c.carried for c in contacts])
    gaps = np.array([c.gap - _SLOP for c in contacts])
    friction = np.array([c.friction for c in contacts])
    found = impulses(delassus, rows @ velocity - carried, np.maximum(gaps, 0.0) / length, friction)
    after = (velocity + moves @ found).reshape(-1, 6)
    for k, one in enumerate(bodies):
        one.velocity, one.spin = after[k, :3], after[k, 3:]
    if (gaps < 0.0).any():
        some = impulses(delassus, np.zeros(len(rows)), _PARTED * gaps / length, np.zeros(len(gaps)))
        parting = (moves @ some).reshape(-1, 6)
    pressed = [c for c, p in zip(contacts, found[::3], strict=True) if p > 0.0]
    return pressed, parting


def _axes(contact: RigidContact) -> NDArray[np.float64]:
    """Normal and two tangents, as ``jacobian`` has them, shape (3, 3)."""
    return np.concatenate([contact.normal[None], np.linalg.svd(contact.normal[None])[2][1:]])
