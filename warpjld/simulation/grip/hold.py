"""Trial whether a hand holds an object's weight at a grip, by removing the object's support (R122–R124)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.grip.search import Trial, TrialOutcome
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_weight import SharedWeight

__all__ = ["Loaded", "WeightTrials"]


@dataclass(frozen=True, eq=False)
class Loaded:
    """What became of an object whose weight came on a closed hand.

    Attributes:
        outcome: How it ended.
        solution: The last state; the equilibrium under the weight if the object is held.
        instants: All states after the hand had closed, in order.
        borne: Largest share of the weight that the hand bore; if it holds, the share that it could bear.
    """

    outcome: TrialOutcome
    solution: ContactSolution
    instants: tuple[ContactInstant, ...]
    borne: float


class WeightTrials(ABC):
    """Trial grips on an object: the callable that ``gentlest_grip`` needs.

    Args:
        weight: The object's weight, shared by the hand and others.
        budget: Linear solves of all trials.

    Attributes:
        found: States of every grip tried, with all load steps.
        hopeless: Share of the weight that friction must be able to bear with the pressures before the support is
            removed. Not 1: under the weight an object drags the pads along and presses them harder, by a fifth on
            fingertips.
        lasting: Whether capacities are those before the weight comes on; then only a trial in which every point slides
            tells by what the hand bore how much more capacity is needed.
    """

    hopeless, lasting = 0.6, False

    def __init__(self, weight: SharedWeight, budget: SearchBudget) -> None:
        self.weight, self.budget = weight, budget
        self.found: dict[float, ContactSolution] = {}
        self._after: dict[float, Loaded] = {}
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
        if most < self.hopeless:
            return self._trial(grip, TrialOutcome.WEAK, closed.last, most)
        self._begun[grip] = self.weight.height(closed.last)
        loaded = self.loaded(grip, closed)
        if not loaded.instants:
            return self._trial(grip, loaded.outcome, closed.last, float("nan"))
        self._after[grip] = loaded
        self.found[grip] = replace(loaded.solution, instants=(*closed.instants, *loaded.instants))
        return self._trial(grip, loaded.outcome, loaded.solution.last, loaded.borne)

    @abstractmethod
    def closed(self, grip: float) -> ContactSolution:
        """State with the hand closed and the object's weight borne by its support."""

    @abstractmethod
    def loaded(self, grip: float, closed: ContactSolution) -> Loaded:
        """What becomes of the object without the support."""

    @abstractmethod
    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Largest load share of the muscles, and the digit that has it."""

    def rate(self, grip: float) -> float | None:
        """Logarithmic derivative of the contact force between hand and object with respect to the grip, before the
        weight acts; None if not known."""
        return None

    def capacity(self, grip: float, instant: ContactInstant) -> float:
        """Share of the weight that friction could bear with the pressures of a grip, at the last state of its trial."""
        return self.weight.most(instant)

    def beneath(self, instant: ContactInstant) -> str:
        """Message about what else bears the object; empty if nothing does."""
        return ""

    def taken(self, grip: float) -> tuple[float, ContactInstant] | None:
        """Displacement of the object's middle along the axis of gravity while its weight comes on [m], and the
        equilibrium then; None if the hand does not hold it."""
        loaded = self._after.get(grip)
        if loaded is None or loaded.outcome is not TrialOutcome.HELD:
            return None
        last = loaded.solution.last
        return self.weight.height(last) - self._begun[grip], last

    def _trial(self, grip: float, outcome: TrialOutcome, instant: ContactInstant, borne: float) -> Trial:
        if not instant.touches:  # not one load step of closing was solved
            return Trial(outcome, float("nan"), 0.0)
        force, sliding = self.weight.force(instant), self.weight.sliding(instant)
        share, who = self.strain(grip, instant)
        note = self.beneath(instant) if outcome is TrialOutcome.STANDS else ""
        known = outcome is not TrialOutcome.UNSOLVED
        capacity = self.capacity(grip, instant) if known else float("nan")
        rate = self.rate(grip) if capacity > 0.0 else None
        slope = None if rate is None else capacity * rate
        loaded, closed = self.lasting or grip in self._after, self.closed(grip)
        pressed = self.weight.force(closed.last) if closed.converged else float("nan")
        telling = not self.lasting or outcome is TrialOutcome.SLIDES
        return Trial(outcome, sliding, force, borne, share, who, note, capacity, slope, loaded, pressed, telling)
