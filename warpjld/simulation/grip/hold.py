"""Whether a hand holds an object's weight at a grip: its support is taken away, and what comes of it (R122–R124).

First the points that the object stands on let go, and a handle in its middle bears what the hand does not; then the
handle is lowered (``warpjld.simulation.grip.lower``).
"""

from __future__ import annotations

import numpy as np

from warpjld.fem import Prescribed
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.grip.lower import Descent, descend
from warpjld.simulation.grip.search import Outcome, Trial
from warpjld.simulation.grip.shared_weight import Weighed
from warpjld.simulation.solve.branch import detour
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.grip.squeeze import Tightening

__all__ = ["Lift"]

_HOPELESS = 0.95
"""A support that could be borne by this share at most is not taken away."""
_FADING, _LETTING_GO = 3, 1
"""How often a step may be halved while the support goes, and when the handle does; steps down may not: shorter ones are
tried then."""


class Lift:
    """Grips tried on an object: the callable that ``gentlest_grip`` asks for.

    Args:
        tightening: The hand.
        one: The object, with its support.

    Attributes:
        weighed: The object's weight, and what bears it.
        descents: How the object was lowered at every grip whose pressures could bear it.

    Raises:
        InputError: An object without a weight, or gravity along no axis.
    """

    def __init__(self, tightening: Tightening, one: ObjectBody) -> None:
        bodies = tightening.bodies
        self._grips, self._one = tightening, one
        self._span = bodies.spans[one.name]
        holding = [k for k, o in enumerate(bodies.owners) if {o.slave, o.master} == {one.name, tightening.hand.name}]
        nodes = np.arange(self._span.start, self._span.stop)
        self.weighed = Weighed(bodies.body, nodes, bodies.pairs, holding, bodies.loads.gravity)
        self.descents: dict[float, Descent] = {}
        self._begun: dict[float, float] = {}

    def __call__(self, grip: float) -> Trial:
        """What a grip does."""
        closed = self._grips.closed(grip)
        if not closed.converged:
            return self._trial(grip, Outcome.UNSOLVED, closed.last, float("nan"))
        if not self.weighed.force(closed.last) > 0.0:
            return self._trial(grip, Outcome.APART, closed.last, 0.0)
        most = self.weighed.most(closed.last)
        if most < _HOPELESS:
            return self._trial(grip, Outcome.WEAK, closed.last, most)
        bare = self._bared(grip, closed)
        if not bare.converged:
            return self._trial(grip, Outcome.UNSOLVED, closed.last, float("nan"))
        self._begun[grip] = self.weighed.height(closed.last)
        descent = descend(
            self.weighed,
            bare,
            lambda after, height: self._moved(grip, after, height),
            lambda after: self._let_go(grip, after),
            foreseen=self._foreseen(grip),
        )
        self.descents[grip] = descent
        return self._trial(grip, descent.outcome, descent.solution.last, descent.borne)

    def taken(self, grip: float) -> tuple[float, ContactInstant] | None:
        """Displacement of the object's middle along the weight's axis when the hand takes it [m], and the equilibrium
        then; None where it does not."""
        descent = self.descents.get(grip)
        if descent is None or descent.outcome is not Outcome.HELD:
            return None
        last = descent.solution.last
        return self.weighed.height(last) - self._begun[grip], last

    def _trial(self, grip: float, outcome: Outcome, instant: ContactInstant, borne: float) -> Trial:
        force, sliding = self.weighed.force(instant), self.weighed.sliding(instant)
        effort = self._grips.effort(grip, instant)
        most = max(effort.digits, key=lambda digit: digit.share)
        note = self._beneath(instant) if outcome is Outcome.STANDS else ""
        return Trial(outcome, sliding, force, borne, most.share, most.digit, note)

    def _beneath(self, instant: ContactInstant) -> str:
        """What else bears the object, and how much."""
        out = []
        for k, owner in enumerate(self._grips.bodies.owners):
            names = {owner.slave, owner.master}
            if self._one.name in names and self._grips.hand.name not in names:
                push = np.linalg.norm(instant.touches[k].nodal[self._span].sum(axis=0))
                if push > 0.0:
                    out.append(f"{', '.join(names - {self._one.name})} bears {push:.3g} N of it")
        return " and ".join(out)

    def _bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """The points it stands on let go, all but the height of its middle."""
        there = self._at(self.weighed.height(closed.last))
        forces = np.zeros_like(closed.last.reactions)
        forces[self._span] = closed.last.reactions[self._span]
        return detour(
            self._grips.bodies,
            closed,
            1,
            moves=self._grips.stays(grip),
            known=(self._one.name, lambda share: there),
            nodal=lambda share: (1.0 - share) * forces,
            halvings=_FADING,
        )

    def _moved(self, grip: float, now: ContactSolution, height: float) -> ContactSolution:
        """Its middle at another height."""
        since = self.weighed.height(now.last)
        way = (self._one.name, lambda share: self._at(since + share * (height - since)))
        return detour(self._grips.bodies, now, 1, moves=self._grips.stays(grip), known=way, halvings=0)

    def _let_go(self, grip: float, lowest: ContactSolution) -> ContactSolution:
        nothing = Prescribed(np.empty(0, np.int64), np.empty(0))
        way = (self._one.name, lambda share: nothing)
        return detour(self._grips.bodies, lowest, 1, moves=self._grips.stays(grip), known=way, halvings=_LETTING_GO)

    def _at(self, height: float) -> Prescribed:
        """The handle at a height, in the object's own numbering."""
        there = self.weighed.at(height)
        return Prescribed(there.degrees - 3 * self._span.start, there.values)

    def _foreseen(self, grip: float) -> float | None:
        """How far the object sank at the nearest grip that held it."""
        held = [one for one, descent in self.descents.items() if descent.outcome is Outcome.HELD]
        near = min(held, key=lambda one: abs(one - grip), default=None)
        return None if near is None else self.descents[near].sunk
