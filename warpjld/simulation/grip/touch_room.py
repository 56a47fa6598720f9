"""How far digits close before they touch: known from distances, without an equilibrium.

A search that closes digits step by step solves contact of all other digits at every step of one that is still on its
way. Until it touches, its flesh moves along with its bones, so the closing at which it touches follows from distances
between that flesh and the other bodies, and the search can begin there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["touch_room"]

Array = NDArray[np.float64]

_STEP = math.radians(1.0)
"""Interval of the closings that are looked at [rad]: a fingertip moves by 1.5 mm, much less than it is thick."""
_HALVINGS = 6
"""Halvings of that interval: to 0.02 degrees, 0.03 mm at a fingertip."""


def touch_room(
    model: ContactModel,
    hand: FleshBody,
    displacement: Array,
    time: float,
    closed: Callable[[float], Array],
    most: float,
) -> dict[str, float]:
    """Closing at which each digit first touches an object or obstacle [rad]; 0 if it does already.

    Args:
        model: The contact model; all but the hand stays as it is.
        hand: The hand that closes; it has to be driven by joint angles.
        displacement: Displacement of all nodes at the equilibrium from which it closes [m], shape (N, 3).
        time: Time of that equilibrium [frames].
        closed: Joint angles (J, 4) at a closing.
        most: Largest closing [rad].

    Returns:
        Closings by digit, such as ``index``; digits that touch nothing up to ``most`` are left out.
    """
    others, rest, start = list(_others(model, hand, displacement, time)), hand.mesh.nodes, hand.shape.start
    skin, digit_of = np.unique(hand.mesh.quads(hand.mesh.face_set(hand.faces))), hand.node_digits
    offset = _offset(model, hand)
    before, first = displacement[model.spans[hand.name]], start.to(hand.moves(time))

    def gaps(closing: float, digits: set[str]) -> dict[str, float]:
        """Smallest distance of each of the digits from the other bodies [m]."""
        after = start.to(hand.bones.moves_of(closed(closing), time))
        x = rest + hand.hand.guess(first, after, before)
        nodes = skin[np.isin(digit_of[skin], list(digits))]
        gap = np.min([distance(x[nodes]) for distance in others], axis=0) - offset[nodes]
        return {digit: float(gap[digit_of[nodes] == digit].min(initial=np.inf)) for digit in digits}

    room: dict[str, float] = {}
    apart, looks, below = set(digit_of) - {"", "palm"}, max(1, math.ceil(most / _STEP)), 0.0
    if not others:
        return room
    for closing in (most * k / looks for k in range(looks + 1)):
        for digit, gap in gaps(closing, apart).items():
            if gap > 0.0:
                continue
            low, high = below, closing
            for _ in range(_HALVINGS if closing > 0.0 else 0):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if gaps(middle, {digit})[digit] <= 0.0 else (middle, high)
            room[digit] = high
        apart, below = apart - room.keys(), closing
        if not apart:
            break
    return room


def _others(
    model: ContactModel, hand: FleshBody, displacement: Array, time: float
) -> Iterator[Callable[[Array], Array]]:
    """Signed distances [m] of points (n, 3) [m] from every body that the hand can touch, besides itself."""
    for pair, owner in zip(model.pairs, model.owners, strict=True):
        other = owner.other(hand.name)
        if other is None or other == hand.name:
            continue
        if isinstance(pair.master, Obstacle):
            yield _from_obstacle(pair.master, time)
        else:
            body, span = model.named(other), model.spans[other]
            quads = body.mesh.quads(body.mesh.face_set(body.faces))
            faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
            surface = Facets(body.mesh.nodes + displacement[span], faces)
            yield _from_surface(surface)


def _from_obstacle(obstacle: Obstacle, time: float) -> Callable[[Array], Array]:
    return lambda points: obstacle.project(points, time).distance


def _from_surface(surface: Facets) -> Callable[[Array], Array]:
    return lambda points: surface.project(points).distance


def _offset(model: ContactModel, hand: FleshBody) -> Array:
    """Height of the hand's visible skin above its mesh [m], shape (N,) of the hand's nodes."""
    for pair, owner in zip(model.pairs, model.owners, strict=True):
        if pair.offset is not None and owner.slave == hand.name and isinstance(pair.master, Obstacle):
            return np.asarray(pair.offset[model.spans[hand.name]])
    return np.zeros(len(hand.mesh.nodes))
