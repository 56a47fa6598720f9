"""Contact solved through time: the way of the animation, and branches aside from it.

A branch begins at an equilibrium that was found and leaves it as it is: what would come of other angles, or without a
support. Unless it is given a duration it takes no time: whatever else moves stands still.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads, Prescribed
from warpjld.fem.contact import ContactSolution, press
from warpjld.fem.hand.blend import Moves
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["solve_branch", "solve_onward"]

_TOLERANCE = 1e-4
"""Residual over the forces that balance: what a film and a table of newtons need."""

_MOMENT = 1e-6
"""Length of a step that takes no time [frames]."""


def solve_onward(
    model: ContactModel,
    history: History,
    after: ContactSolution | None,
    times: Sequence[float],
    *,
    loads: Callable[[float], Loads] | None = None,
    method: str = "augmented",
    aitken: bool = False,
    halvings: int | None = None,
) -> ContactSolution:
    """Equilibria at rising times after another, or after rest; its status says whether the last was found.

    Args:
        model: Everything.
        history: What first guesses build on.
        after: Where it begins; None at rest.
        times: [frames] from the model's start.
        loads: At a time, where not as the model has them.
        method: The solver's; ``aitken`` relaxes the paper's loop.
        halvings: How often a step may be halved; by default as long as it may help.
    """
    return press(
        model.body,
        lambda time: model.prescribed(time, history),
        model.pairs,
        loads or (lambda time: model.loads_at(time, history)),
        times=times,
        after=after,
        method=method,
        aitken=aitken,
        tolerance=_TOLERANCE,
        guess=lambda before, time, displacement: model.guess(before, time, displacement, history),
        halvings=halvings,
        check=False,
    )


def solve_branch(
    model: ContactModel,
    history: History,
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
        model: Everything.
        history: What first guesses build on.
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

    def clock(time: float) -> float:
        return begin if duration is None else time

    def loads(time: float) -> Loads:
        here = model.loads_at(clock(time), history)
        if nodal is None:
            return here
        return replace(here, nodal=nodal(share(time)) + (0.0 if here.nodal is None else here.nodal))

    hands = {hand.name: hand.timed(clock) for hand in model.hands}
    objects = {one.name: one.timed(clock) for one in model.objects}
    if moves is not None:
        name, along = moves
        hands[name] = replace(hands[name], moves=lambda time: along(share(time)))
    if known is not None:
        name, prescribed = known
        objects[name] = replace(objects[name], other=lambda time: prescribed(share(time)))
    aside = replace(model, hands=tuple(hands.values()), objects=tuple(objects.values()))
    times = [begin + length * (k + 1) / steps for k in range(steps)]
    return solve_onward(aside, history, after, times, loads=loads, halvings=halvings)
