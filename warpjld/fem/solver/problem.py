"""Static problem of a body: prescribed displacements and loads as functions of a load factor (B eq. 5, R107)."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.load.loads import Loads, external_forces, subtract_pressure_stiffness
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.linear import LinearSolver
from warpjld.fem.solver.solution import Instant, Solution

__all__ = ["Problem"]


class Problem:
    """Static problem of a body, starting at rest or at a given equilibrium.

    Args:
        body: Mesh and laws.
        prescribed: Displacements at the full load.
        loads: Forces at the full load.
        after: Equilibrium to start from.
        method: Linear solver (see ``LinearSolver``).
        precision: Its precision.

    Attributes:
        start: Initial displacement [m], shape (3N,).
        free: Mask of degrees of freedom that are not prescribed, shape (3N,).
    """

    def __init__(
        self,
        body: Body,
        prescribed: Prescribed,
        loads: Loads,
        after: Solution | None = None,
        *,
        method: str = "auto",
        precision: str = "float64",
    ) -> None:
        self.body = body
        self.prescribed = prescribed
        self.loads = loads
        self.after = after
        self.start = np.zeros(body.degrees) if after is None else after.displacement.reshape(-1)
        self.free = prescribed.free(body.degrees)
        self._options: dict[str, Any] = {"precision": precision, "threads": body.threads, "poisson": body.poisson}
        self._method = method
        self._hierarchy: list[Any] | None = None

    def known(self, factor: float) -> Array:
        """Prescribed displacements at a load factor, interpolated from the start, shape (n,)."""
        start: Array = self.start[self.prescribed.degrees]
        return start + factor * (self.prescribed.values - start)

    def external(self, factor: float, u: Array | None) -> Array:
        """Nodal forces at a load factor and displacement (at rest for linear laws), shape (3N,)."""
        forces = factor * external_forces(self.body, self.loads, u)
        if self.after is not None and factor != 1.0:
            before = external_forces(self.body, self.after.loads, u) + self.after.reactions.reshape(-1)
            forces += (1.0 - factor) * before
        return forces

    def subtract_pressure(self, stiffness: BlockMatrix, factor: float, u: Array) -> None:
        """Subtract the load stiffness of follower pressures, in place."""
        subtract_pressure_stiffness(stiffness, self.body, self.loads, u, factor)
        if self.after is not None and factor != 1.0:
            subtract_pressure_stiffness(stiffness, self.body, self.after.loads, u, 1.0 - factor)

    def solver(self, stiffness: BlockMatrix) -> LinearSolver:
        """A linear solver for a tangent stiffness.

        Raises:
            IndefiniteError: Found during set-up.
        """
        solver = LinearSolver(
            stiffness, self.free, self.body.mesh, hierarchy=self._hierarchy, method=self._method, **self._options
        )
        self._hierarchy = solver.hierarchy
        return solver

    def direct_solver(self, stiffness: BlockMatrix) -> LinearSolver:
        """A direct solver for a stiffness that may be indefinite."""
        return LinearSolver(stiffness, self.free, self.body.mesh, definite=False, method="direct", **self._options)

    def reactions(self, forces: Array) -> Array:
        """Internal minus external forces (3N,) at prescribed degrees of freedom, zero elsewhere, shape (N, 3)."""
        return np.where(self.free, 0.0, forces).reshape(-1, 3)

    def beginning(self) -> Instant:
        """The state before any load."""
        reactions = np.zeros((self.body.degrees // 3, 3)) if self.after is None else self.after.reactions
        return Instant(0.0, self.start.reshape(-1, 3), reactions, 0, 0, 0.0)
