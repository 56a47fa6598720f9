"""Trial whether a simulated hand holds an object's weight at a grip, by letting the object ride along (R122–R124).

While the digits close, the object's weight is borne and it is free to move with them through a viscous medium
(``warpjld.simulation.grip.ride``). Then its weight comes on, and it moves on until it rests, or evidently will not: it
is held if it rests, and an equilibrium without the medium is found there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import SensitivityError
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.grip.hold import Loaded, WeightTrials
from warpjld.simulation.grip.ride import Ride, RideStep
from warpjld.simulation.grip.search import TrialOutcome
from warpjld.simulation.grip.shared_weight import SharedWeight
from warpjld.simulation.grip.squeeze import TRAVEL, Squeeze

__all__ = ["RIDING", "HandTrials"]

RIDING = 3.0 * TRAVEL
"""Largest motion of a joint in one step of closing [m]: an object that gives way meets no more than a third of the
force of one that is held."""
_CUTS = 3
"""Most halvings of a step of closing."""
_SETTLED, _SETTLES = 0.2, 12
"""Share of the weight still to be balanced at which a closed hand is taken to be in balance, and most steps until
then."""
_RESTS, _STEPS = 0.02, 40
"""Share of the weight still to be balanced at which the object counts as at rest under its weight, and most steps until
then."""
_FINER = 0.1
"""The former share once more, over its first value, if no equilibrium without the medium was found there."""
_FAR, _AHEAD = 0.25, 0.1
"""Way under the weight, over the object's height, from which on it counts as not held; and that which it would still
have to go until it rests."""
_ON = 2
"""Successive steps after which it would still have to go so far, for it to count as not held."""
_WEAK = 0.9
"""Share of the weight that friction must be able to bear with the pressures of an object that slides at every point."""
_LOST = 2
"""Attempts at steps that fail while every point slides, from which on the object counts as not held: no friction is
left to hold it back."""
_ALL = 1.0 - 1e-9
"""Share of the contact area that slides from which on all of it counts as sliding."""
_LEFT = 0.01
"""Share of the weight borne by other bodies at which the object stands on them."""


class HandTrials(WeightTrials):
    """Trial grips of a simulated hand on an object that lies on a support until the hand closes on.

    Args:
        squeeze: The closing hand.
        one: The object, with its support.

    Attributes:
        ride: Motion of the object.

    Raises:
        InputError: An object without weight, or gravity not along one axis.
    """

    hopeless, lasting = 0.85, True

    def __init__(self, squeeze: Squeeze, one: ObjectBody) -> None:
        model = squeeze.model
        self.squeeze, self._one = squeeze, one
        self._span = model.spans[one.name]
        holding = [k for k, owner in enumerate(model.owners) if owner.other(one.name) == squeeze.hand.name]
        nodes = np.arange(self._span.start, self._span.stop)
        weight = SharedWeight(model.body, nodes, model.pairs, holding, model.loads.gravity)
        super().__init__(weight, squeeze.budget)
        self.ride = Ride(model, squeeze.history, one.name, weight.tall, squeeze.budget)
        self._known: dict[float, ContactSolution] = {0.0: squeeze.first}
        self._passed: dict[float, ContactSolution] = {}
        self._failed: dict[float, ContactSolution] = {}

    def closed(self, grip: float) -> ContactSolution:
        """State with the joints flexed by the grip and the object where they balance, with its weight borne."""
        if grip in self._known or grip in self._failed:
            return self._known.get(grip) or self._failed[grip]
        begun = self._passed | self._known
        at = max(known for known in begun if known < grip)
        here, instants = begun[at], list(begun[at].instants) if at in self._passed else list[ContactInstant]()
        whole = (grip - at) / self.squeeze.steps(at, grip, RIDING)
        part, left = whole, 0.0
        while at < grip:
            ahead = grip if at + 1.001 * part >= grip else at + part
            self.ride.begin()
            done = self.ride.step(here, self.squeeze.closes(at, ahead), borne=1.0)
            if done is None:
                part *= 0.5
                if part < 0.5**_CUTS * whole or self.budget.exhausted:
                    status = SolveStatus.EXHAUSTED if self.budget.exhausted else SolveStatus.MAX_ITERATIONS
                    self._failed[grip] = replace(here, status=status)
                    return self._failed[grip]
                continue
            at, here = ahead, done.solution
            instants += here.instants
            left = done.left
            self._passed[at] = replace(here, instants=(*instants,))
        if self.weight.most(here.last) >= self.hopeless and left > _SETTLED * self.weight.weight:
            here = self._balanced(grip, here, instants)
        self._known[grip] = replace(here, instants=(*instants,) or here.instants)
        return self._known[grip]

    def _balanced(self, grip: float, here: ContactSolution, instants: list[ContactInstant]) -> ContactSolution:
        """State after the object has moved to where the digits nearly balance."""
        for _ in range(_SETTLES):
            done = self.ride.step(here, self.squeeze.stays(grip), borne=1.0)
            if done is None:
                break
            here = done.solution
            instants += here.instants
            if done.left < _SETTLED * self.weight.weight:
                break
        return here

    def loaded(self, grip: float, closed: ContactSolution) -> Loaded:
        """What becomes of the object once its weight comes on."""
        ride, stays, weight = self.ride, self.squeeze.stays(grip), self.weight
        begin = here = self._balanced(grip, closed, []) if grip == 0.0 else closed
        instants, least, on, rests = list[ContactInstant](), 1.0, 0, _RESTS
        before: RideStep | None = None
        ride.begin(loaded=True)
        for _ in range(_STEPS):
            done = ride.step(here, stays)
            if done is None:
                return Loaded(TrialOutcome.UNSOLVED, here, tuple(instants), 1.0 - least)
            here = done.solution
            instants += here.instants
            left = done.left / weight.weight
            least = min(least, left)
            if left < rests:
                free = ride.let_go(here, stays)
                if free.converged:
                    stands = weight.elsewhere(free.last) > _LEFT
                    outcome = TrialOutcome.STANDS if stands else TrialOutcome.HELD
                    return Loaded(outcome, free, (*instants, *free.instants), weight.most(free.last))
                if rests < _RESTS:
                    return Loaded(TrialOutcome.UNSOLVED, here, tuple(instants), 1.0 - least)
                rests *= _FINER
            more = self._goes_on(done, before)
            on = on + more if more else 0
            outcome_now = self._outcome(here, begin, on)
            if outcome_now is not None:
                return Loaded(outcome_now, here, tuple(instants), 1.0 - least)
            before = done
        return Loaded(TrialOutcome.UNSOLVED, here, tuple(instants), 1.0 - least)

    def _goes_on(self, now: RideStep, before: RideStep | None) -> int:
        """1 if the object would still have to go far until it rests, as its drag hardly becomes less; 2 if that grows.

        The stiffness c with which the digits hold it back reduces what is left to D / (D + c) of it in a step.
        """
        if before is None or now.left < _RESTS * self.weight.weight:
            return 0
        held_back = now.drag * (before.left / now.left - 1.0)
        if held_back * _AHEAD * self.weight.tall >= now.left:
            return 0
        return 1 if held_back > 0.0 else 2

    def _outcome(self, here: ContactSolution, begin: ContactSolution, on: int) -> TrialOutcome | None:
        """Outcome if the hand evidently does not hold the object; None to continue."""
        weight, last = self.weight, here.last
        if weight.elsewhere(last) > _LEFT:
            return TrialOutcome.STANDS
        if not weight.force(last) > 0.0:
            return TrialOutcome.APART
        slides = weight.sliding(last) >= _ALL
        if slides and (weight.most(last) < _WEAK or self.ride.failed >= _LOST):
            return TrialOutcome.SLIDES
        if on >= _ON:
            return TrialOutcome.SLIDES if slides else TrialOutcome.GIVES
        return TrialOutcome.SANK if self.ride.way(here, begin) > _FAR * weight.tall else None

    def capacity(self, grip: float, instant: ContactInstant) -> float:
        """Share of the weight that friction could bear with the pressures before the weight acts; under it, an object
        that rode along is pressed as hard within a tenth, unless it slips."""
        return self.weight.most(self.closed(grip).last)

    def rate(self, grip: float) -> float | None:
        """Logarithmic derivative of the contact force before the weight acts, without the medium around the object."""
        closed = self.closed(grip)
        if not (closed.converged and self.weight.force(closed.last) > 0.0):
            return None
        try:
            return self.weight.rate(*self.squeeze.tangent(grip, closed))
        except SensitivityError:
            return None

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
