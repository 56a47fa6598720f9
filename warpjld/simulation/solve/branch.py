"""Contact followed aside from the frames of an animation: what would come of other angles, or without a support.

A detour begins at an equilibrium that was found and leaves it as it is. Unless it is given a duration it takes no time:
whatever else moves stands still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads, Prescribed
from warpjld.fem.contact import ContactSolution, press
from warpjld.fem.hand.blend import Moves
from warpjld.simulation.bodies.model import Bodies

__all__ = ["TOLERANCE", "detour"]

TOLERANCE = 1e-4
"""Residual over the forces that balance: what a film and a table of newtons need."""

_T = TypeVar("_T")

_MOMENT = 1e-6
"""Length of a step that takes no time [frames]."""


def detour(
    bodies: Bodies,
    after: ContactSolution,
    steps: int,
    *,
    moves: tuple[str, Callable[[float], Moves]] | None = None,
    known: tuple[str, Callable[[float], Prescribed]] | None = None,
    nodal: Callable[[float], NDArray[np.float64]] | None = None,
    duration: float | None = None,
    halvings: int | None = None,
) -> ContactSolution:
    """Equilibria along a way; functions of it are given the share of it that is done, 0 … 1.

    Args:
        bodies: Everything.
        after: Where it begins.
        steps: Equilibria on the way.
        moves: A hand's name and what its bones do instead of the animation.
        known: An object's name and what is prescribed for its nodes instead of its states and support.
        nodal: Forces on all nodes beside the loads [N], shape (N, 3).
        duration: Time it takes [frames].
        halvings: How often a step may be halved: whether something holds is known much sooner than it is known that
            nothing does.
    """
    begin = after.last.time
    length = steps * _MOMENT if duration is None else duration

    def share(time: float) -> float:
        return min(1.0, max(0.0, (time - begin) / length))

    def frozen(time: float) -> float:
        return begin if duration is None else time

    hands = [replace(hand, moves=_after(hand.moves, frozen)) for hand in bodies.hands]
    objects = [replace(one, place=_after(one.place, frozen)) for one in bodies.objects]
    if moves is not None:
        k = next(k for k, hand in enumerate(hands) if hand.name == moves[0])
        hands[k] = replace(hands[k], moves=_after(moves[1], share))
    if known is not None:
        k = next(k for k, one in enumerate(objects) if one.name == known[0])
        objects[k] = replace(objects[k], other=_after(known[1], share))
    aside = replace(bodies, hands=tuple(hands), objects=tuple(objects))

    def loads(time: float) -> Loads:
        here = bodies.loads_at(begin if duration is None else time)
        if nodal is None:
            return here
        return replace(here, nodal=nodal(share(time)) + (0.0 if here.nodal is None else here.nodal))

    return press(
        aside.body,
        aside.prescribed,
        aside.pairs,
        loads,
        times=[begin + length * (k + 1) / steps for k in range(steps)],
        after=after,
        tolerance=TOLERANCE,
        guess=aside.guess,
        halvings=halvings,
        check=False,
    )


def _after(function: Callable[[float], _T], inner: Callable[[float], float]) -> Callable[[float], _T]:
    return lambda time: function(inner(time))
