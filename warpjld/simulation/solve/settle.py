"""From where a fallen object came to rest as a rigid body to its equilibrium as a deformable one (R139).

A fall is that of a rigid body on rigid surfaces. Where it ends, three points may bear the object; it gives way there,
or flesh below it does, and it sinks and turns until more of it is borne, which Newton's method does not follow in one
step; what may roll is held by nothing before that. It sinks in a medium that resists motion in proportion to mass, in
backward Euler steps of the overdamped motion (pseudo-transient continuation: Kelley and Keyes 1998, SIAM J. Numer.
Anal. 35, 508–523), while everything else stands still. The medium becomes thinner as less is left to balance; what
comes to rest in it is in equilibrium without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warpjld.fem import Loads
from warpjld.fem.contact import ContactSolution
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.fall.bonded import bonded_groups
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.specification import BondStrength

__all__ = ["free_objects", "settled"]

_MOMENT = 1e-6
"""Nominal length of a step, in which the animation hardly moves [frames]."""
_WAY = 2e-4
"""Way of an object in a step in which nothing bears it, with the first drag [m]: a tenth of the flesh of a finger's
pad, whose stiffness changes with it."""
_STIFFER, _SOFTER = 4.0, 0.4
"""Factors on the drag after a step that fails, and after one that converges; as for objects that ride along."""
_RESTS = 1e-3
"""Share of its weight that may be left on the medium when an object rests."""
_STEPS, _FAILURES, _SOLVES = 60, 4, 20
"""Most steps, most that fail one after another, and most linear solves of one."""


def free_objects(model: ContactModel, bonds: Sequence[BondStrength], since: float | None, time: float) -> list[str]:
    """Objects with weight that nothing holds at a time, neither themselves nor what they are bonded to, and that were
    falling until then, or are at their start (``since`` None) [frames from the model's start]."""
    held = {one.name for one in model.objects if len(one.prescribed(time, History()).degrees) or one.rides(time)}
    groups = bonded_groups([one.name for one in model.objects], bonds)
    held |= {name for group in groups if not held.isdisjoint(group) for name in group}
    out = []
    for one in model.objects:
        fell = since is None or any(abs(fall.ends - since) < _MOMENT for fall in one.falls)
        if fell and one.name not in held and np.any(model.pull(one.name)):
            out.append(one.name)
    return out


def settled(
    model: ContactModel, history: History, before: ContactSolution | None, names: Sequence[str]
) -> ContactSolution | None:
    """Where objects come to rest; what was reached if they do not within the steps allowed.

    Args:
        model: The contact model.
        history: History of the supports.
        before: Solution to start from; None: from rest.
        names: Names of the objects.
    """
    each = {name: np.linalg.norm(model.pull(name), axis=1) for name in names}
    weight = {name: float(share.sum()) for name, share in each.items()}
    drag, failures = 1.0, 0
    for _ in range(_STEPS):
        now = 0.0 if before is None else before.last.time
        around = sum((drag / _WAY * share for share in each.values()), np.zeros(len(model.body.mesh.nodes)))

        def loads(time: float, around: np.ndarray = around) -> Loads:
            return replace(model.loads_at(time, history), drag=_MOMENT * around)

        found = solve_onward(model, history, before, [now + _MOMENT], loads=loads, halvings=0, solves=_SOLVES)
        if not found.converged:
            failures, drag = failures + 1, _STIFFER * drag
            if failures > _FAILURES:
                break
            continue
        was = 0.0 if before is None else before.last.displacement
        way = np.linalg.norm(found.last.displacement - was, axis=1)
        left = max(drag / _WAY * float(share @ way) / weight[name] for name, share in each.items())
        # the correction of a step without length says nothing of those to come
        before, failures = replace(found, correction_rate=None), 0
        if left < _RESTS:
            break
        drag *= _SOFTER
    return before
