"""Trial grips of arbitrary bodies whose Dirichlet conditions close on an object, without a hand (R122–R124).

The object does not move while they close, as no weight acts. Then its weight comes on while the height of a central
node (the handle) is prescribed, which bears what the bodies do not, and the handle is lowered
(``warpjld.simulation.grip.lower``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.contact import ContactInstant, ContactSolution, Pair, press
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, SensitivityError
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.grip.hold import Loaded, WeightTrials
from warpjld.simulation.grip.lower import Lowering, lower_object
from warpjld.simulation.grip.search import TrialOutcome
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_weight import SharedWeight

__all__ = ["PrescribedTrials"]

_COMES_ON = 2
"""Most halvings of the load step that applies the weight."""
_STEP = 1e-3
"""Step of the finite difference of the prescribed displacements, relative to the grip."""


class PrescribedTrials(WeightTrials):
    """Trial grips parametrised by prescribed displacements: a distance [m], an angle [rad], ….

    A grip closes in proportion to time from 0 to 1 without gravity, so that the object stays in place; the weight is
    applied until time 2 with the handle's height fixed, and every step down takes one unit of time.

    Args:
        body: Hand and object, merged.
        prescribed: Dirichlet conditions of a grip; zero at grip 0.
        pairs: Contact pairs that hold the object.
        name: Region of the object.
        gravity: Acceleration along one axis [m/s²].
        loads: Loads that act from the start, as the pressure inside an object.
        others: Contact pairs of the object with other bodies; what these bear, the hand does not hold.
        share: Largest load share of the muscles at an instant, and who has it.
        budget: Linear solves that all trials may take; by default those of a grip in a script.

    Attributes:
        lowered: Descent of the object at every grip whose pressures could bear it.

    Raises:
        InputError: No pairs, no such object, or gravity not along one axis.
    """

    def __init__(
        self,
        body: Body,
        prescribed: Callable[[float], Prescribed],
        pairs: Sequence[Pair],
        name: str,
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        *,
        loads: Loads | None = None,
        others: Sequence[Pair] = (),
        share: Callable[[ContactInstant], tuple[float, str]] | None = None,
        budget: SearchBudget | None = None,
    ) -> None:
        if not pairs:
            raise InputError("pairs: want one that may hold the object")
        mesh = body.mesh
        if name not in mesh.region_names:
            raise InputError(f"name: there is no region '{name}'; there are {', '.join(mesh.region_names)}")
        self.prescribed, self._share = prescribed, share
        self._loads = loads or Loads()
        self._heavy = replace(self._loads, gravity=gravity)
        self._closed: dict[float, ContactSolution] = {}
        own = np.unique(mesh.elements[mesh.regions == mesh.region_names.index(name)])
        touching = [*pairs, *others]
        super().__init__(SharedWeight(body, own, touching, range(len(pairs)), gravity), budget or SearchBudget())
        self.body, self.pairs = body, touching
        self.lowered: dict[float, Lowering] = {}

    def closed(self, grip: float) -> ContactSolution:
        """Equilibrium at the grip without gravity, after that at the largest known grip below it."""
        if grip not in self._closed:
            less = max((one for one, found in self._closed.items() if one < grip and found.converged), default=0.0)
            before = self._closed.get(less)
            begin = 0.0 if before is None else before.last.time

            def known(time: float) -> Prescribed:
                return self.prescribed(less + min(time - begin, 1.0) * (grip - less))

            self._closed[grip] = self._press(known, self._loads, begin + 1.0, before)
        return self._closed[grip]

    def loaded(self, grip: float, closed: ContactSolution) -> Loaded:
        """Apply the weight with the handle's height fixed, then lower the handle until it bears nothing."""
        bare = self.bared(grip, closed)
        if not bare.converged:
            return Loaded(TrialOutcome.UNSOLVED, closed, (), float("nan"))
        lowered = lower_object(
            self.weight,
            bare,
            lambda after, height: self.moved(grip, after, height),
            lambda after: self.released(grip, after),
            predicted=self._predicted(grip),
            rate=lambda after: self._sinking(grip, after),
        )
        self.lowered[grip] = lowered
        instants = (*bare.instants, *lowered.instants)
        return Loaded(lowered.outcome, lowered.solution, instants, lowered.borne)

    def held(self, grip: float) -> NDArray[np.int64]:
        """Prescribed degrees of freedom of the grip."""
        return np.asarray(self._at(grip, 1.0).degrees)

    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Tangent for a change of the grip."""
        known, step = self._at(grip, 1.0), _STEP * max(grip, 1e-9)
        change = np.zeros(self.body.degrees)
        change[known.degrees] = (self._at(grip + step, 1.0).values - known.values) / step
        tangent = EquilibriumTangent(self.body, self.pairs, closed, known.degrees, steadied=True)
        return tangent, Perturbation(prescribed=change)

    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """Equilibrium under the weight, with the handle's height fixed."""
        return self._lowered(grip, closed, self.weight.height(closed.last), halvings=_COMES_ON)

    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """Equilibrium under the weight, with the handle at another height [m]."""
        return self._lowered(grip, after, height)

    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """Equilibrium under the weight without the handle."""
        return self._lowered(grip, after, None)

    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """Load share by the caller's function; 0 without contact."""
        return self._share(instant) if self._share is not None and instant.touches else (0.0, "")

    def _sinking(self, grip: float, after: ContactSolution) -> float | None:
        """Derivative of the weight share that the hand bears with respect to lowering the handle [1/m]; None if not
        known."""
        known = np.append(self.held(grip), 3 * self.weight.handle + self.weight.axis)
        try:
            tangent = EquilibriumTangent(self.body, self.pairs, after, known, steadied=True)
            return self.weight.relief(tangent)
        except SensitivityError:
            return None

    def rate(self, grip: float) -> float | None:
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

    def _at(self, grip: float, time: float) -> Prescribed:
        return self.prescribed(min(time, 1.0) * grip)

    def _lowered(
        self, grip: float, after: ContactSolution, height: float | None, *, halvings: int = 0
    ) -> ContactSolution:
        begin, since = after.last.time, self.weight.height(after.last)

        def known(time: float) -> Prescribed:
            held = self._at(grip, 1.0)
            return held if height is None else held + self.weight.at(since + (time - begin) * (height - since))

        return self._press(known, self._heavy, begin + 1.0, after, halvings)

    def _press(
        self,
        known: Callable[[float], Prescribed],
        loads: Loads,
        time: float,
        after: ContactSolution | None = None,
        halvings: int | None = None,
    ) -> ContactSolution:
        found = press(
            self.body,
            known,
            self.pairs,
            lambda now: loads,
            times=[time],
            after=after,
            halvings=halvings,
            solves=self.budget.next,
            check=False,
        )
        return self.budget.counted(found)
