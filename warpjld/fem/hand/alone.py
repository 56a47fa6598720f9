"""A hand's flesh without what touches it, in the same pose: what bent joints strain on their own (R118).

Reactions that hold the bones of a pressed hand balance two things: contact, and flesh that is strained because joints
are bent. Muscles' work is the former. The latter is found by taking the contact away while the bones stay: an
equilibrium of the hand's own mesh, without contact.

Strained flesh may have several equilibria in one pose: skin folds this way or that. The one that counts is that which
the pressed flesh goes back to, so it is looked for from there: Newton's method starts at the pressed shape less the
dent that was found last, and has few steps to arrive; where it does not, contact forces fade in halved steps, each of
which begins at an equilibrium.
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
from warpjld.fem.loads import Loads
from warpjld.fem.multigrid import IndefiniteError
from warpjld.fem.prescribed import Prescribed
from warpjld.fem.solution import Instant, Solution
from warpjld.fem.static import solve

__all__ = ["FleshAlone", "Untouched"]

_STEPS = 6
"""Newton steps from a first guess; one that needs more is on its way to somewhere else."""
_TOLERANCE = 1e-4
"""Residual over the contact forces that were taken away."""
_ROUNDING = 1e-12
"""The same over the forces that hold the bones."""
_KEPT = 16


@dataclass(frozen=True, eq=False)
class Untouched:
    """Equilibrium of a hand that nothing touches.

    Attributes:
        displacement: [m], shape (N, 3).
        reactions: Forces that hold the prescribed nodes [N], zero elsewhere, shape (N, 3).
    """

    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]


class FleshAlone:
    """Equilibria without contact, each pose's found once.

    Args:
        body: A hand's own mesh and laws.
        degrees: Prescribed degrees of freedom, shape (n,): those of bones, and of nodes where flesh was cut off.
    """

    def __init__(self, body: Body, degrees: NDArray[np.int64]) -> None:
        self.body = body
        self._degrees = degrees
        self._free = Prescribed(degrees, np.zeros(len(degrees))).free(body.degrees)
        self._elastic = Elastic(body)
        self._solver = StepSolver(body, "float64")
        self._dent = np.zeros(body.degrees)
        self._known: dict[bytes, Untouched] = {}

    def at(
        self,
        displacement: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: NDArray[np.float64],
        loads: Loads | None = None,
    ) -> Untouched | None:
        """The hand with its bones as they are and nothing that touches it; None where no equilibrium is found.

        Args:
            displacement: Of an equilibrium with contact [m], shape (N, 3).
            reactions: Forces that hold its prescribed nodes [N], shape (N, 3).
            contact: Contact forces on its nodes [N], shape (N, 3).
            loads: What else pulls, and stays.

        Raises:
            InputError: Other shapes.
        """
        for name, array in (("displacement", displacement), ("reactions", reactions), ("contact", contact)):
            if array.shape != self.body.mesh.nodes.shape:
                raise InputError(f"{name}: want shape {self.body.mesh.nodes.shape}, got {array.shape}")
        if not contact.any():
            return Untouched(displacement, reactions)
        u = displacement.reshape(-1)
        key = u[self._degrees].tobytes()
        if key not in self._known:
            found = self._near(u, contact, loads or Loads())
            if found is None:
                found = self._fading(u, reactions, contact, loads or Loads())
            if found is None:
                return None
            self._dent = found.displacement.reshape(-1) - u
            if len(self._known) >= _KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = found
        return self._known[key]

    def _near(self, u: NDArray[np.float64], contact: NDArray[np.float64], loads: Loads) -> Untouched | None:
        """By Newton's method, if that arrives in few steps."""
        elastic, free = self._elastic, self._free
        pressures = elastic.pressures(u)  # a guess is squeezed here and there, an equilibrium is not
        start, u = u, u + self._dent
        if not elastic.upright(u):
            u = start
        self._solver.begin()
        for step in range(_STEPS + 1):
            external = elastic.external(loads, u)
            forces = elastic.forces(u).forces
            residual = np.where(free, external - forces, 0.0)
            balance = np.where(free, 0.0, forces - external)
            if norm(residual) <= max(_TOLERANCE * norm(contact.reshape(-1)), _ROUNDING * norm(balance)):
                return Untouched(u.reshape(-1, 3), balance.reshape(-1, 3))
            stiffness = elastic.at(u, pressures, loads).stiffness
            if step == _STEPS or stiffness is None:
                break
            try:
                done = self._solver.solve(stiffness, free, residual)
            except IndefiniteError:
                break
            if done.status is not Status.CONVERGED or not elastic.upright(u + done.x):
                break
            pressures = elastic.pressures(u, done.x)
            u = u + done.x
        return None

    def _fading(
        self,
        u: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: NDArray[np.float64],
        loads: Loads,
    ) -> Untouched | None:
        """By letting the contact forces fade."""
        shape = (-1, 3)
        pressed = Instant(1.0, u.reshape(shape), reactions + contact, 0, 0, 0.0)
        found = solve(
            self.body,
            Prescribed(self._degrees, u[self._degrees]),
            loads,
            after=Solution(Status.CONVERGED, (pressed,), "", np.empty(0, np.int64), loads),
            tolerance=_TOLERANCE,
            check=False,
        )
        return Untouched(found.displacement, found.reactions) if found.converged else None
