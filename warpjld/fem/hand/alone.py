"""A hand's flesh in some pose without what touches it: what bent joints strain on their own (R118).

Reactions that hold the bones of a pressed hand balance two things: contact, and flesh that is strained because joints
are bent. Muscles' work is the former. The latter is found by an equilibrium of the hand's own mesh, without contact.

It is gone to as a hand that nothing touches goes there: from the nearest pose that is known, the flesh carried along by
its bones. That start lies so near that Newton's method takes two or three steps, and which way skin folds, where it may
fold either way, is what such a hand has folded to. The pressed shape is no place to start from: without what presses
it, and with its forces no less, it may be unstable where flesh is pressed hard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.conjugate import Status
from warpjld.fem.contact.elastic import Elastic
from warpjld.fem.contact.step_solver import StepSolver
from warpjld.fem.dots import norm
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.loads import Loads
from warpjld.fem.multigrid import IndefiniteError
from warpjld.fem.prescribed import Prescribed
from warpjld.fem.solution import Instant, Solution
from warpjld.fem.static import solve

__all__ = ["FleshAlone", "Untouched"]

_STEPS = 8
"""Newton steps from a first guess; one that needs more is on its way to somewhere else."""
_TOLERANCE = 1e-4
"""Residual over the contact forces that are missing: what contact itself is solved to."""
_ROUNDING = 1e-10
"""The same over the forces that hold the bones, where contact forces are next to nothing."""
_KEPT = 16


@dataclass(frozen=True, eq=False)
class Untouched:
    """Equilibrium of a hand that nothing touches.

    Attributes:
        moves: Motions of its bones from where they rest.
        displacement: [m], shape (N, 3).
        reactions: Forces that hold the prescribed nodes [N], zero elsewhere, shape (N, 3).
    """

    moves: Moves
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]


class FleshAlone:
    """Equilibria without contact, each pose's found once.

    Args:
        hand: At rest.
        body: Its own mesh and laws.
        degrees: Prescribed degrees of freedom, shape (n,): those of bones, and of nodes where flesh was cut off.
    """

    def __init__(self, hand: FleshHand, body: Body, degrees: NDArray[np.int64]) -> None:
        self.body = body
        self._hand = hand
        self._degrees = degrees
        self._free = Prescribed(degrees, np.zeros(len(degrees))).free(body.degrees)
        self._elastic = Elastic(body)
        self._solver = StepSolver(body, "float64")
        nothing = np.zeros_like(body.mesh.nodes)
        self._known = [Untouched(hand.place.still(), nothing, nothing)]

    def at(
        self,
        moves: Moves,
        displacement: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: NDArray[np.float64],
        loads: Loads | None = None,
    ) -> Untouched | None:
        """The hand with its bones as they are and nothing that touches it; None where no equilibrium is found.

        Args:
            moves: Motions of its bones from where they rest.
            displacement: Of an equilibrium with contact in that pose [m], shape (N, 3).
            reactions: Forces that hold its prescribed nodes [N], shape (N, 3).
            contact: Contact forces on its nodes [N], shape (N, 3).
            loads: What else pulls, and stays.

        Raises:
            InputError: Other shapes.
        """
        for name, array in (("displacement", displacement), ("reactions", reactions), ("contact", contact)):
            if array.shape != self.body.mesh.nodes.shape:
                raise InputError(f"{name}: want shape {self.body.mesh.nodes.shape}, got {array.shape}")
        bones = displacement.reshape(-1)[self._degrees]
        away = [float(np.abs(one.displacement.reshape(-1)[self._degrees] - bones).max()) for one in self._known]
        nearest = int(np.argmin(away))
        if away[nearest] == 0.0 and nearest > 0:
            return self._known[nearest]
        if contact.any():
            found = self._from(self._known[nearest], moves, bones, norm(contact.reshape(-1)), loads or Loads())
        else:
            found = Untouched(moves, displacement, reactions)
        if found is not None:
            if len(self._known) > _KEPT:
                self._known.pop(1)  # rest stays
            self._known.append(found)
        return found

    def _from(
        self, before: Untouched, moves: Moves, bones: NDArray[np.float64], pushed: float, loads: Loads
    ) -> Untouched | None:
        """From another pose."""
        guess = self._hand.guess(before.moves, moves, before.displacement).reshape(-1)
        guess[self._degrees] = bones
        found = self._newton(before, guess, pushed, loads)
        if found is None:
            last = Instant(1.0, before.displacement, before.reactions, 0, 0, 0.0)
            solution = solve(
                self.body,
                Prescribed(self._degrees, bones),
                loads,
                after=Solution(Status.CONVERGED, (last,), "", np.empty(0, np.int64), loads),
                tolerance=_TOLERANCE,
                check=False,
            )
            if not solution.converged:
                return None
            found = solution.displacement, solution.reactions
        return Untouched(moves, *found)

    def _newton(
        self, before: Untouched, u: NDArray[np.float64], pushed: float, loads: Loads
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Displacement and reactions from a first guess (3N,), if that is near enough."""
        elastic, free = self._elastic, self._free
        if not elastic.upright(u):
            return None
        # a guess squeezes elements here and there, an equilibrium does not
        pressures = elastic.pressures(before.displacement.reshape(-1))
        self._solver.begin()
        for _ in range(_STEPS):
            forces, external = elastic.forces(u).forces, elastic.external(loads, u)
            residual = np.where(free, external - forces, 0.0)
            balance = np.where(free, 0.0, forces - external)
            if norm(residual) <= max(_TOLERANCE * pushed, _ROUNDING * norm(balance)):
                return u.reshape(-1, 3), balance.reshape(-1, 3)
            stiffness = elastic.at(u, pressures, loads).stiffness
            assert stiffness is not None
            try:
                done = self._solver.solve(stiffness, free, residual)
            except IndefiniteError:
                return None
            if done.status is not Status.CONVERGED or not elastic.upright(u + done.x):
                return None
            pressures = elastic.pressures(u, done.x)
            u = u + done.x
        return None
