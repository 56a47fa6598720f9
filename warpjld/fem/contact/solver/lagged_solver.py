"""Linear solves of one load step after another, with a preconditioner kept while it serves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.body import Body
from warpjld.fem.solver.block_matrix import BlockMatrix
from warpjld.fem.solver.conjugate import Iteration, Status
from warpjld.fem.solver.linear import LinearSolver

__all__ = ["LaggedSolver"]

_INNER = 1e-4
_MOST = 150
"""Iterations of a solve that is not symmetric."""
_PATIENCE = 25
"""Iterations after which a preconditioner made for an earlier matrix has served its time."""


class LaggedSolver:
    """Solves with the matrices of a contact problem, one like the other.

    Args:
        body: All bodies, merged.
        precision: ``float64``, or ``float32`` refined.
    """

    def __init__(self, body: Body, precision: str) -> None:
        self._options: dict[str, Any] = {"precision": precision, "threads": body.threads, "poisson": body.poisson}
        self._mesh = body.mesh
        self._hierarchy: list[Any] | None = None
        self._solver: LinearSolver | None = None

    def begin(self) -> None:
        """A new step: its first matrix gets a preconditioner of its own."""
        self._solver = None

    def solve(self, matrix: BlockMatrix, free: Mask, right: Array, beside: Any = None) -> Iteration:
        """K11 x = b for the free degrees of freedom, shape (3N,), with the preconditioner before while it serves.

        Raises:
            IndefiniteError: K is not positive definite.
        """
        if beside is not None:
            return self._beside(matrix, free, right, beside)
        sofar = None
        if self._solver is not None:
            before = self._solver.of(matrix)
            done = before.solve(right, tolerance=_INNER, iterations=_PATIENCE)
            if done.status is Status.CONVERGED:
                return done
            if done.status is Status.MAX_ITERATIONS and done.residual < 1.0:
                sofar = done
                left = right - before.masked_product(done.x)
        solver = LinearSolver(matrix, free, self._mesh, hierarchy=self._hierarchy, **self._options)
        if sofar is not None:  # go on from where the old preconditioner got to
            done = solver.solve(left, tolerance=_INNER / sofar.residual)
            done = replace(done, x=done.x + sofar.x, iterations=done.iterations + sofar.iterations)
        else:
            done = solver.solve(right, tolerance=_INNER)
        self._solver, self._hierarchy = solver, solver.hierarchy
        return done

    def _beside(self, matrix: BlockMatrix, free: Mask, right: Array, beside: Any) -> Iteration:
        """With a part that is not symmetric; what is symmetric makes the preconditioner."""
        if self._solver is not None:
            done = self._solver.over(matrix).solve_beside(beside, right, tolerance=_INNER, iterations=_PATIENCE)
            if done.status is Status.CONVERGED:
                return done
        solver = LinearSolver(matrix, free, self._mesh, hierarchy=self._hierarchy, **self._options)
        done = solver.over(matrix).solve_beside(beside, right, tolerance=_INNER, iterations=_MOST)
        self._solver, self._hierarchy = solver, solver.hierarchy
        return done
