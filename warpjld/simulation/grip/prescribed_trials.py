"""Grips of any bodies in contact, without a hand: what is prescribed of them closes on an object (R122–R124)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.contact import ContactInstant, ContactSolution, Pair, press
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.grip.hold import WeightTrials
from warpjld.simulation.grip.shared_weight import SharedWeight

__all__ = ["PrescribedTrials"]

_COMES_ON = 2
"""How often the step in which a weight comes on may be halved."""
_STEP = 1e-3
"""Of the differences in what is prescribed, over the grip."""


class PrescribedTrials(WeightTrials):
    """Grips of any bodies in contact that are measured by what is prescribed of them: a way [m], an angle [rad], ….

    A grip closes without gravity in proportion to time from 0 to 1, which keeps the object where the hand meets it; the
    weight comes on at 2 while the handle keeps its height, and every step down takes one more.

    Args:
        body: Hand and object, merged.
        prescribed: Known displacements of a grip; at 0 nothing is displaced.
        pairs: What holds the object, and nothing else.
        name: Of the object's region.
        gravity: Along one axis [m/s²].
        loads: What else acts from the start, as the pressure inside an object.
        others: What else the object may touch: what they bear, the hand does not hold.
        share: Largest share of the muscles' limits at an instant, and who has it.

    Raises:
        InputError: No pairs, no such object, or gravity along no axis.
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
        super().__init__(SharedWeight(body, own, touching, range(len(pairs)), gravity), body, touching)

    def closed(self, grip: float) -> ContactSolution:
        """What is prescribed of the grip is reached, without gravity."""
        if grip not in self._closed:
            self._closed[grip] = self._press(lambda time: self._at(grip, time), self._loads, 1.0)
        return self._closed[grip]

    def held(self, grip: float) -> NDArray[np.int64]:
        """Those of the grip."""
        return np.asarray(self._at(grip, 1.0).degrees)

    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """What is prescribed goes on in proportion."""
        known, step = self._at(grip, 1.0), _STEP * max(grip, 1e-9)
        change = np.zeros(self.body.degrees)
        change[known.degrees] = (self._at(grip + step, 1.0).values - known.values) / step
        tangent = EquilibriumTangent(self.body, self.pairs, closed, known.degrees, steadied=True)
        return tangent, Perturbation(prescribed=change)

    def bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """The weight comes on, and the handle keeps its height."""
        return self._lowered(grip, closed, self.weight.height(closed.last), halvings=_COMES_ON)

    def moved(self, grip: float, after: ContactSolution, height: float) -> ContactSolution:
        """The handle at another height under the whole weight."""
        return self._lowered(grip, after, height)

    def released(self, grip: float, after: ContactSolution) -> ContactSolution:
        """The whole weight without a handle."""
        return self._lowered(grip, after, None)

    def strain(self, grip: float, instant: ContactInstant) -> tuple[float, str]:
        """As the caller measures it; none where nothing touches."""
        return self._share(instant) if self._share is not None and instant.touches else (0.0, "")

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
        return press(
            self.body,
            known,
            self.pairs,
            lambda now: loads,
            times=[time],
            after=after,
            halvings=halvings,
            check=False,
        )
