"""Load steps in which a free object gives way: through a medium that resists its motion, and fades (R112).

An object that nothing but contact holds moves, when a hand presses it, to where the forces on it balance. That may be
millimetres away, past places where it slips, rolls or loses a contact, and Newton's method finds no equilibrium there.
Here the object moves through a viscous medium, in backward Euler steps of the overdamped motion (pseudo-transient
continuation: Kelley and Keyes 1998, SIAM J. Numer. Anal. 35, 508–523), first while the hand moves, then while it stays.
The medium becomes thinner where steps converge quickly, and thicker where they do not. Once hardly anything moves, the
last step is solved without it, or else with so little that it bears no more than what an equilibrium may leave over:
what is returned is an equilibrium, or was not found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads, SolveStatus
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["AGAIN_SOLVES", "EASED_SOLVES", "ROUGH", "UNEASED_SOLVES", "around_free_objects", "solve_eased"]

Array = NDArray[np.float64]
Step = Callable[[ContactSolution | None, float, Callable[[float], Loads], bool], ContactSolution]
"""One load step: solution to start from, time, loads, and whether it is exact and not only passed through."""

EASED_SOLVES, UNEASED_SOLVES, AGAIN_SOLVES = 20, 30, 100
"""Most linear solves of a step through the medium, of one without it before the object is let give way, and of one
where it did not come to rest: a load step that is cut where bodies first touch, or halved, takes up to 30."""

ROUGH = 1e-2
"""Residual of a step through the medium, over the forces in balance: it is only passed through."""

_DRAG = 1e3
"""First drag of an object [N/m]: about the stiffness of a finger's pad that presses with 1 N."""
_STIFFER, _SOFTER = 4.0, 0.4
"""Factors on the drag after a step that fails, and after one of few solves; as for objects that ride along."""
_FEW = 10
"""Linear solves of a step from which on the drag is not reduced."""
_MOMENT = 5e-4
"""Part of the load step that passes in a step in which the hand stays."""
_MOVES, _STEPS, _FAILURES, _MOST = 4, 60, 4, 200
"""Steps while the hand moves, most while it stays, most that fail one after another, and most linear solves."""
_RESTS = 2e-2
"""Force of the medium over what presses from which on an equilibrium without the medium is looked for, once."""
_NOTHING, _UNFELT = 1e-4, 1e-4
"""Force of the medium over what presses that counts as none, as equilibria are found to no less, and one that is too
small to count [N]: what rolls on two digits, or is touched by one, is held by nothing else."""


def around_free_objects(model: ContactModel, since: float, time: float) -> Array | None:
    """Share of an object's drag on each of its nodes, for objects that only contact holds, shape (N,), 0 elsewhere;
    None if there is none."""
    out = np.zeros(len(model.body.mesh.nodes))
    for one in model.objects:
        held = len(one.prescribed(time, History()).degrees) or one.rides(since) or one.rides(time)
        if not held:
            span = model.spans[one.name]
            out[span] = 1.0 / (span.stop - span.start)
    return out if out.any() else None


def solve_eased(
    step: Step, loads: Callable[[float], Loads], before: ContactSolution | None, time: float, around: Array
) -> ContactSolution:
    """Equilibrium at a time, reached through a medium; its status tells whether it was found.

    Args:
        step: Solves a load step.
        loads: Loads without the medium at a time.
        before: Solution to start from; None: from rest.
        time: Time of the equilibrium.
        around: Share of the drag on each node, shape (N,).
    """
    since = 0.0 if before is None else before.last.time
    moment = _MOMENT * (time - since)
    stays = time - (_STEPS + 1) * moment
    here, found, drag, failures, spent, exact = before, before, _DRAG, 0, 0, False
    instants: list[ContactInstant] = []
    part = (stays - since) / _MOVES
    while spent < _MOST:
        now = since if here is None else here.last.time
        ahead = min(now + part, stays) if stays - now > moment else now + moment
        if ahead >= time - 0.5 * moment:
            break
        found = step(here, ahead, _dragged(loads, (ahead - now) * drag * around), exact)
        spent += found.spent
        if not found.converged:
            failures, drag = failures + 1, _STIFFER * drag
            if ahead <= stays:
                part *= 0.5
            if failures > _FAILURES:
                break
            continue
        left = drag * _way(here, found, around)
        softer, failures = found.spent <= _FEW and failures == 0, 0
        # the correction of a step in which hardly anything moves says nothing of those to come
        here = replace(found, correction_rate=None)
        instants += found.instants
        if ahead > stays - 0.5 * moment:
            last, nothing = None, max(_NOTHING * _pushes(found), _UNFELT)
            if left <= nothing:
                last = step(here, time, _dragged(loads, (time - ahead) * drag * around), True)
                thin = drag
            elif not exact and left <= _RESTS * _pushes(found):
                last, thin = step(here, time, loads, True), 0.0
            if last is not None:
                spent += last.spent
                if last.converged and thin * _way(here, last, around) <= nothing:
                    return replace(last, instants=(*instants, *last.instants), spent=spent)
                exact = True
        if softer:
            drag *= _SOFTER
    assert found is not None
    status = SolveStatus.MAX_ITERATIONS if found.converged else found.status
    return replace(found, status=status, spent=spent)


def _way(before: ContactSolution | None, after: ContactSolution, around: Array) -> float:
    """Mean way of free objects between two solutions [m]."""
    was = 0.0 if before is None else before.last.displacement
    return float(around @ np.linalg.norm(after.last.displacement - was, axis=1))


def _pushes(solution: ContactSolution) -> float:
    """Sum of the contact forces on all nodes [N]."""
    return sum(float(np.linalg.norm(touch.nodal, axis=1).sum()) for touch in solution.last.touches)


def _dragged(loads: Callable[[float], Loads], drag: Array) -> Callable[[float], Loads]:
    return lambda time: replace(loads(time), drag=drag)
