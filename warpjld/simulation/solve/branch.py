"""Contact solved along the animation (``solve_onward``), and along trial branches off it (``solve_branch``).

A branch starts from a known equilibrium, which it leaves unchanged, and answers what-if questions: other joint angles,
or no support. Unless it has a duration, the animation stands still meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads, Prescribed
from warpjld.fem.contact import ContactInstant, ContactSolution, press
from warpjld.fem.hand.blend import Moves
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.eased import (
    AGAIN_SOLVES,
    EASED_SOLVES,
    ROUGH,
    UNEASED_SOLVES,
    around_free_objects,
    solve_eased,
)

__all__ = ["solve_branch", "solve_onward"]

_TOLERANCE = 1e-4
"""Convergence tolerance, residual over the forces in balance; chosen as enough for films and tables of forces."""

_MOMENT = 1e-6
"""Nominal length of a load step on a branch without duration [frames]."""


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
    solves: int | None = None,
    tolerance: float = _TOLERANCE,
    ease: bool = False,
) -> ContactSolution:
    """Solve equilibria at ascending times from a previous solution, or from rest.

    Args:
        model: The contact model.
        history: History for predictors and supports.
        after: Solution to start from; None: from rest.
        times: Times [frames from the model's start].
        loads: External loads at a time; by default those of the model.
        method: Solution method, see ``press``.
        aitken: Whether the paper's loop uses Aitken relaxation.
        halvings: Most halvings of a load step; by default as many as ``press`` allows.
        solves: Most linear solves; by default as many as ``press`` allows.
        tolerance: Convergence tolerance, residual over the forces in balance.
        ease: Whether free objects give way through a medium where no equilibrium is found otherwise (``solve_eased``).

    Returns:
        The solution; its status says whether the last time was reached.
    """
    asked = loads or (lambda time: model.loads_at(time, history))

    def pressed(
        before: ContactSolution | None,
        times: Sequence[float],
        loads: Callable[[float], Loads],
        halvings: int | None,
        solves: int | None,
        tolerance: float = tolerance,
    ) -> ContactSolution:
        return press(
            model.body,
            lambda time: model.prescribed(time, history),
            model.pairs,
            loads,
            times=times,
            after=before,
            method=method,
            aitken=aitken,
            tolerance=tolerance,
            guess=lambda before, time, displacement: model.guess(before, time, displacement, history),
            halvings=halvings,
            solves=solves,
            check=False,
        )

    since = 0.0 if after is None else after.last.time
    around = around_free_objects(model, since, times[-1]) if ease else None
    if around is None:
        return pressed(after, times, asked, halvings, solves)

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        return pressed(before, [time], loads, 0, EASED_SOLVES, tolerance if exact else ROUGH)

    here, instants, spent = after, list[ContactInstant](), 0

    def left(most: int) -> int:
        return most if solves is None else max(0, min(most, solves - spent))

    for time in times:
        found = pressed(here, [time], asked, halvings, left(UNEASED_SOLVES))
        spent += found.spent
        if not found.converged and left(1):
            found = solve_eased(step, asked, here, time, around)
            spent += found.spent
        if not found.converged:
            found = pressed(here, [time], asked, halvings, left(AGAIN_SOLVES))
            spent += found.spent
        instants += found.instants
        if not found.converged:
            return replace(found, instants=(*instants,), spent=spent)
        here = found
    assert here is not None
    return replace(here, instants=(*instants,), spent=spent)


def solve_branch(
    model: ContactModel,
    history: History,
    after: ContactSolution,
    steps: int,
    *,
    moves: tuple[str, Callable[[float], Moves]] | None = None,
    known: tuple[str, Callable[[float], Prescribed]] | None = None,
    nodal: Callable[[float], NDArray[np.float64]] | None = None,
    drag: NDArray[np.float64] | None = None,
    duration: float | None = None,
    halvings: int | None = None,
    solves: int | None = None,
    tolerance: float = _TOLERANCE,
    ease: bool = False,
) -> ContactSolution:
    """Solve equilibria along a trial branch; its functions take the branch parameter, 0 … 1.

    Args:
        model: The contact model.
        history: History for predictors and supports.
        after: Solution at which the branch starts.
        steps: Number of load steps along the branch.
        moves: Name of a hand, and the bone motions that replace those of the animation.
        known: Name of an object, and the Dirichlet conditions that replace its state variables and support.
        nodal: Additional nodal forces [N], shape (N, 3).
        drag: Stiffness with which nodes resist motion since the start of each load step [N/m], shape (N,).
        duration: Duration of the branch [frames]; None: the animation stands still.
        halvings: Most halvings of a load step; a small number gives up early where there may be no equilibrium.
        solves: Most linear solves.
        tolerance, ease: As in ``solve_onward``.
    """
    begin = after.last.time
    length = steps * _MOMENT if duration is None else duration

    def share(time: float) -> float:
        return min(1.0, max(0.0, (time - begin) / length))

    def clock(time: float) -> float:
        return begin if duration is None else time

    def loads(time: float) -> Loads:
        here = model.loads_at(clock(time), history)
        if drag is not None:
            here = replace(here, drag=length / steps * drag)
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
    return solve_onward(
        aside,
        history,
        after,
        times,
        loads=loads,
        halvings=halvings,
        solves=solves,
        tolerance=tolerance,
        ease=ease,
    )
