"""The equilibrium with which frames go on once a hand alone holds what it lifts: the one its search found (R123).

While an object's weight comes on, it moves and the digits' skin slips on it. How hard they press in the end depends on
that path, by some percent; the gentlest grip leaves less. So the frames, whose times are the animation's, do not repeat
the search: they end at its equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.load.loads import Loads
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["HandedOver"]

_SAME = 1e-6
"""Largest difference of the bones' positions up to which a hand is where it was in the search [m]: a hundredth of the
slip of a load step."""


@dataclass(frozen=True, eq=False)
class HandedOver:
    """An equilibrium of a lifted object, held by a hand alone.

    Attributes:
        hand: Name of the hand.
        free: Time from which on the hand alone holds it [frames from the model's start].
        displacement: Displacement from rest [m], shape (N, 3).
        states: Contact state of each pair.
    """

    hand: str
    free: float
    displacement: NDArray[np.float64]
    states: tuple[ContactState, ...]

    def start(self, model: ContactModel, history: History, since: float, time: float) -> ContactSolution | None:
        """The equilibrium as of a time before the handing over; None if that is not between ``since`` and ``time``, or
        if the hand is not where it was in the search.

        Args:
            model: The contact model.
            history: Its history.
            since, time: Times between which a frame is solved [frames from the model's start].
        """
        if not since < self.free <= time:
            return None
        known, span = model.prescribed(self.free, history), model.spans[self.hand]
        own = (known.degrees >= 3 * span.start) & (known.degrees < 3 * span.stop)
        there = self.displacement.reshape(-1)[known.degrees[own]]
        if np.abs(there - known.values[own]).max(initial=0.0) > _SAME:
            return None
        instant = ContactInstant(since, self.displacement, np.zeros_like(self.displacement), (), 0, 0, 0.0)
        return ContactSolution(SolveStatus.CONVERGED, (instant,), "", self.states, (), Loads())
