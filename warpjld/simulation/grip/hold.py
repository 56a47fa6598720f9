"""Whether a hand holds an object's weight at a grip: its support is taken away, and what comes of it (R122–R124).

First what the object stands on lets go, and a handle in its middle bears what the hand does not; then the handle is
lowered (``warpjld.simulation.grip.lower``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.body import Body
from warpjld.fem.contact import ContactInstant, ContactSolution, Pair
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, SensitivityError
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.grip.lower import Lowering, lower_object
from warpjld.simulation.grip.search import Trial, TrialOutcome
from warpjld.simulation.grip.shared_weight import SharedWeight
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.solve.branch import solve_branch

__all__ = ["HandTrials", "WeightTrials"]

_FADING, _LETTING_GO = 3, 1
"""How often a step may be halved while the support goes, and when the handle does; steps down may not: shorter ones are
tried then."""
_HOPELESS = 0.6
"""Share of the weight that pressures must be able to bear before its support is taken away. Not 1: as the weight comes
on, an object drags pads along and presses them harder, by a fifth on fingertips."""
_NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))


class WeightTrials(ABC):
    """Grips tried on an object: the callable that ``gentlest_grip`` asks for.

    Args:
        weight: The object's weight, and what bears it.
        body: Hand and object, merged.
        pairs: What may touch.

    Attributes:
        found: The equilibria of every grip tried, those on the way included.
        lowered: How the object was lowered at every grip whose pressures could bear it.
    """

    def __init__(self, weight: SharedWeight, body: Body, pairs: Sequence[Pair]) -> None:
        self.weight, self.body, self.pairs = weight, body, list(pairs)
        self.found: dict[float, ContactSolution] = {}
        self.lowered: dict[float, Lowering] = {}
        self._begun: dict[float, float] = {}

    def __call__(self, grip: float) -> Trial:
        """What a grip does."""
        closed = self.closed(grip)
        self.found[grip] = closed
        if not closed.converged:
            return self._trial(grip, TrialOutcome.UNSOLVED, closed.last, float("nan"))
        if not self.weight.force(closed.last) > 0.0:
            return self._trial(grip, TrialOutcome.APART, closed.last, 0.0)
        most = self.weight.most(closed.last)
        if most < _HOPELESS:
            return self._trial(grip, TrialOutcome.WEAK, closed.last, most)
        bare = self.bared(grip, closed)
        if not bare.converged:
            return self._trial(grip, TrialOutcome.UNSOLVED, closed.last, float("nan"))
        self._begun[grip] = self.weight.height(closed.last)
        lowered = lower_object(
            self.weight,
            bare,
            lambda after, height: self.moved(grip, after, height),
            lambda after: self.released(grip, after),
            predicted=self._predicted(grip),
            rate=lambda after: self._sinking(grip, after),
        )
        self.lowered[grip] = lowered
        instants = (*closed.instants, *bare.instants, *lowered.instants)
        self.found[grip] = replace(lowered.solution, instants=instants)
        return self._trial(grip, lowered.outcome, lowered.solution.last, lowered.borne)

    @abstractmethod
    def closed(self, grip: float) -> ContactSolution:
        """Equilibrium in which the hand has closed, and something else bears the object."""

    @abstractmethod
    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """After it: all the weight on hand and handle."""

    @abstractmethod
    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """After another: the handle at a height [m]."""

    @abstractmethod
    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """After another: without the handle."""

    def _sinking(self, grip: float, after: ContactSolution) -> float | None:
        """How much more of the weight the hand bears per metre that the handle goes down; None where not known."""
        known = np.append(self.held(grip), 3 * self.weight.handle + self.weight.axis)
        try:
            tangent = EquilibriumTangent(self.body, self.pairs, after, known, steadied=True)
            return self.weight.relief(tangent)
        except SensitivityError:
            return None

    @abstractmethod
    def held(self, grip: float) -> NDArray[np.int64]:
        """Prescribed degrees of freedom while the object has nothing but hand and handle, the handle's left out."""

    @abstractmethod
    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Of that equilibrium, and what a firmer grip changes, per unit of it.

        Raises:
            SensitivityError: No derivative.
        """

    @abstractmethod
    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Largest share of the muscles' limits, and the digit that has it."""

    def beneath(self, instant: ContactInstant) -> str:
        """What else bears the object, and how much."""
        return ""

    def taken(self, grip: float) -> tuple[float, ContactInstant] | None:
        """Displacement of the object's middle along the weight's axis when the hand takes it [m], and the equilibrium
        then; None where it does not."""
        lowered = self.lowered.get(grip)
        if lowered is None or lowered.outcome is not TrialOutcome.HELD:
            return None
        last = lowered.solution.last
        return self.weight.height(last) - self._begun[grip], last

    def _trial(self, grip: float, outcome: TrialOutcome, instant: ContactInstant, borne: float) -> Trial:
        force, sliding = self.weight.force(instant), self.weight.sliding(instant)
        share, who = self.strain(grip, instant)
        note = self.beneath(instant) if outcome is TrialOutcome.STANDS else ""
        known = outcome is not TrialOutcome.UNSOLVED and bool(instant.touches)
        capacity = self.weight.most(instant) if known else float("nan")
        rate = self._rate(grip) if capacity > 0.0 else None
        slope = None if rate is None else capacity * rate
        loaded, closed = grip in self.lowered, self.closed(grip)
        pressed = self.weight.force(closed.last) if closed.converged else float("nan")
        return Trial(outcome, sliding, force, borne, share, who, note, capacity, slope, loaded, pressed)

    def _rate(self, grip: float) -> float | None:
        """How fast the forces between hand and object grow with the grip, as a share of them, before the weight is on;
        None where that is not known."""
        closed = self.closed(grip)
        if not (closed.converged and self.weight.force(closed.last) > 0.0):
            return None
        try:
            return self.weight.rate(*self.tangent(grip, closed))
        except SensitivityError:
            return None

    def _predicted(self, grip: float) -> float | None:
        """How far the object sank at the nearest grip that held it."""
        held = [one for one, lowered in self.lowered.items() if lowered.outcome is TrialOutcome.HELD]
        near = min(held, key=lambda one: abs(one - grip), default=None)
        return None if near is None else self.lowered[near].sunk


class HandTrials(WeightTrials):
    """Grips of a hand on an object of a simulation, which stands on its support.

    Args:
        squeeze: The hand.
        one: The object, with its support.

    Raises:
        InputError: An object without a weight, or gravity along no axis.
    """

    def __init__(self, squeeze: Squeeze, one: ObjectBody) -> None:
        model = squeeze.model
        self.squeeze, self._one = squeeze, one
        self._span = model.spans[one.name]
        holding = [k for k, owner in enumerate(model.owners) if owner.other(one.name) == squeeze.hand.name]
        nodes = np.arange(self._span.start, self._span.stop)
        weight = SharedWeight(model.body, nodes, model.pairs, holding, model.loads.gravity)
        super().__init__(weight, model.body, model.pairs)

    def closed(self, grip: float) -> ContactSolution:
        """Joints flexed by the grip."""
        return self.squeeze.closed(grip)

    def held(self, grip: float) -> NDArray[np.int64]:
        """Those of the hand, and of all other bodies."""
        squeeze, span = self.squeeze, self._span
        known = squeeze.model.prescribed(squeeze.time, squeeze.history).degrees
        return np.asarray(known[(known < 3 * span.start) | (known >= 3 * span.stop)])

    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Joints that flex on, all alike."""
        return self.squeeze.tangent(grip, closed)

    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """The points it stands on let go, all but the height of its middle."""
        there = self._at(self.weight.height(closed.last))
        forces = np.zeros_like(closed.last.reactions)
        forces[self._span] = closed.last.reactions[self._span]
        return self._branch(grip, closed, lambda share: there, _FADING, nodal=lambda share: (1.0 - share) * forces)

    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """Its middle at another height."""
        since = self.weight.height(after.last)
        return self._branch(grip, after, lambda share: self._at(since + share * (height - since)), 0)

    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """Held by nothing but the hand."""
        return self._branch(grip, after, lambda share: _NOTHING, _LETTING_GO)

    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Of the hand's muscles."""
        most = max(self.squeeze.effort(grip, instant).digits, key=lambda digit: digit.share)
        return most.share, most.digit

    def beneath(self, instant: ContactInstant) -> str:
        """What else bears the object, and how much."""
        out = []
        for owner, touch in zip(self.squeeze.model.owners, instant.touches, strict=True):
            other = owner.other(self._one.name)
            if other not in (None, self.squeeze.hand.name):
                push = np.linalg.norm(touch.nodal[self._span].sum(axis=0))
                if push > 0.0:
                    out.append(f"{other} bears {push:.3g} N of it")
        return " and ".join(out)

    def _branch(
        self,
        grip: float,
        after: ContactSolution,
        known: Callable[[float], Prescribed],
        halvings: int,
        nodal: Callable[[float], NDArray[np.float64]] | None = None,
    ) -> ContactSolution:
        """After another equilibrium, the hand as it is at a grip and this prescribed of the object."""
        model, history = self.squeeze.model, self.squeeze.history
        moves = self.squeeze.stays(grip)
        known_of_it = (self._one.name, known)
        return solve_branch(model, history, after, 1, moves=moves, known=known_of_it, nodal=nodal, halvings=halvings)

    def _at(self, height: float) -> Prescribed:
        """The handle at a height, in the object's own numbering."""
        there = self.weight.at(height)
        return Prescribed(there.degrees - 3 * self._span.start, there.values)
