"""Trial whether a hand holds an object's weight at a grip, by removing the object's support (R122–R124).

First the support points are released while the height of a central node (the handle) is prescribed, which then bears
what the hand does not; then the handle is lowered (``warpjld.simulation.grip.lower``).
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
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_weight import SharedWeight
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.solve.branch import solve_branch

__all__ = ["HandTrials", "WeightTrials"]

_FADING, _LETTING_GO = 3, 1
"""Most halvings of the load step that releases the support, and of that which releases the handle; steps down are not
halved but repeated with a shorter step."""
_HOPELESS = 0.6
"""Share of the weight that friction must be able to bear with the pressures before the support is removed. Not 1: under
the weight an object drags the pads along and presses them harder, by a fifth on fingertips."""
_NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))
"""No Dirichlet conditions."""


class WeightTrials(ABC):
    """Trial grips on an object: the callable that ``gentlest_grip`` needs.

    Args:
        weight: The object's weight, shared by hand and handle.
        body: Hand and object, merged.
        pairs: Contact pairs.
        budget: Linear solves of all trials.

    Attributes:
        found: Equilibria of every grip tried, with all load steps.
        lowered: Descent of the object at every grip whose pressures could bear it.
    """

    def __init__(self, weight: SharedWeight, body: Body, pairs: Sequence[Pair], budget: SearchBudget) -> None:
        self.weight, self.body, self.pairs, self.budget = weight, body, list(pairs), budget
        self.found: dict[float, ContactSolution] = {}
        self.lowered: dict[float, Lowering] = {}
        self._begun: dict[float, float] = {}

    def __call__(self, grip: float) -> Trial:
        """Trial of a grip."""
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
        """Equilibrium with the hand closed and the object on its support."""

    @abstractmethod
    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """Subsequent equilibrium without the support: hand and handle bear the weight."""

    @abstractmethod
    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """Subsequent equilibrium with the handle at a height [m]."""

    @abstractmethod
    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """Subsequent equilibrium without the handle."""

    def _sinking(self, grip: float, after: ContactSolution) -> float | None:
        """Derivative of the weight share that the hand bears with respect to lowering the handle [1/m]; None if not
        known."""
        known = np.append(self.held(grip), 3 * self.weight.handle + self.weight.axis)
        try:
            tangent = EquilibriumTangent(self.body, self.pairs, after, known, steadied=True)
            return self.weight.relief(tangent)
        except SensitivityError:
            return None

    @abstractmethod
    def held(self, grip: float) -> NDArray[np.int64]:
        """Prescribed degrees of freedom without the object's support, those of the handle excluded."""

    @abstractmethod
    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Tangent at the equilibrium ``closed``, and the perturbation per unit of the grip.

        Raises:
            SensitivityError: The equilibrium has no derivative.
        """

    @abstractmethod
    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Largest load share of the muscles, and the digit that has it."""

    def beneath(self, instant: ContactInstant) -> str:
        """Message about what else bears the object; empty if nothing does."""
        return ""

    def taken(self, grip: float) -> tuple[float, ContactInstant] | None:
        """Displacement of the handle along the axis of gravity when the hand takes the object [m], and the equilibrium
        then; None if the hand does not hold it."""
        lowered = self.lowered.get(grip)
        if lowered is None or lowered.outcome is not TrialOutcome.HELD:
            return None
        last = lowered.solution.last
        return self.weight.height(last) - self._begun[grip], last

    def _trial(self, grip: float, outcome: TrialOutcome, instant: ContactInstant, borne: float) -> Trial:
        if not instant.touches:  # not one load step of closing was solved
            return Trial(outcome, float("nan"), 0.0)
        force, sliding = self.weight.force(instant), self.weight.sliding(instant)
        share, who = self.strain(grip, instant)
        note = self.beneath(instant) if outcome is TrialOutcome.STANDS else ""
        known = outcome is not TrialOutcome.UNSOLVED
        capacity = self.weight.most(instant) if known else float("nan")
        rate = self._rate(grip) if capacity > 0.0 else None
        slope = None if rate is None else capacity * rate
        loaded, closed = grip in self.lowered, self.closed(grip)
        pressed = self.weight.force(closed.last) if closed.converged else float("nan")
        return Trial(outcome, sliding, force, borne, share, who, note, capacity, slope, loaded, pressed)

    def _rate(self, grip: float) -> float | None:
        """Logarithmic derivative of the contact force between hand and object with respect to the grip, before the
        weight acts; None if not known."""
        closed = self.closed(grip)
        if not (closed.converged and self.weight.force(closed.last) > 0.0):
            return None
        try:
            return self.weight.rate(*self.tangent(grip, closed))
        except SensitivityError:
            return None

    def _predicted(self, grip: float) -> float | None:
        """Descent of the object at the nearest grip that held it [m]; None if none did."""
        held = [one for one, lowered in self.lowered.items() if lowered.outcome is TrialOutcome.HELD]
        near = min(held, key=lambda one: abs(one - grip), default=None)
        return None if near is None else self.lowered[near].sunk


class HandTrials(WeightTrials):
    """Trial grips of a simulated hand on an object that stands on its support.

    Args:
        squeeze: The closing hand.
        one: The object, with its support.

    Raises:
        InputError: An object without weight, or gravity not along one axis.
    """

    def __init__(self, squeeze: Squeeze, one: ObjectBody) -> None:
        model = squeeze.model
        self.squeeze, self._one = squeeze, one
        self._span = model.spans[one.name]
        holding = [k for k, owner in enumerate(model.owners) if owner.other(one.name) == squeeze.hand.name]
        nodes = np.arange(self._span.start, self._span.stop)
        weight = SharedWeight(model.body, nodes, model.pairs, holding, model.loads.gravity)
        super().__init__(weight, model.body, model.pairs, squeeze.budget)

    def closed(self, grip: float) -> ContactSolution:
        """Equilibrium with the joints flexed by the grip."""
        return self.squeeze.closed(grip)

    def held(self, grip: float) -> NDArray[np.int64]:
        """Prescribed degrees of freedom of all bodies but the object."""
        squeeze, span = self.squeeze, self._span
        known = squeeze.model.prescribed(squeeze.time, squeeze.history).degrees
        return np.asarray(known[(known < 3 * span.start) | (known >= 3 * span.stop)])

    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Tangent for all joints flexing at the same rate."""
        return self.squeeze.tangent(grip, closed)

    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """Equilibrium after the reactions of the support points are ramped down, with the handle's height fixed."""
        there = self._at(self.weight.height(closed.last))
        forces = np.zeros_like(closed.last.reactions)
        forces[self._span] = closed.last.reactions[self._span]
        return self._branch(grip, closed, lambda share: there, _FADING, nodal=lambda share: (1.0 - share) * forces)

    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """Equilibrium with the handle at another height [m]."""
        since = self.weight.height(after.last)
        return self._branch(grip, after, lambda share: self._at(since + share * (height - since)), 0)

    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """Equilibrium with the object held by the hand alone."""
        return self._branch(grip, after, lambda share: _NOTHING, _LETTING_GO)

    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Largest load share of the hand's muscles, and its digit."""
        most = max(self.squeeze.effort(grip, instant).digits, key=lambda digit: digit.share)
        return most.share, most.digit

    def beneath(self, instant: ContactInstant) -> str:
        """Message about what else bears the object; empty if nothing does."""
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
        """Equilibrium in one step after another, with the hand fixed at a grip and given conditions of the object."""
        model, history = self.squeeze.model, self.squeeze.history
        moves, conditions = self.squeeze.stays(grip), (self._one.name, known)
        most = self.budget.next
        found = solve_branch(
            model, history, after, 1, moves=moves, known=conditions, nodal=nodal, halvings=halvings, solves=most
        )
        return self.budget.counted(found)

    def _at(self, height: float) -> Prescribed:
        """Dirichlet condition of the handle's height, in the object's own node numbering."""
        there = self.weight.at(height)
        return Prescribed(there.degrees - 3 * self._span.start, there.values)
