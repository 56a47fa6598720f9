"""Linear solves of a contact problem: by a sparse factor where that is cheap, else with a lagged preconditioner."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError
from warpjld.fem.body import Body
from warpjld.fem.solver.elimination import work_by_profile
from warpjld.fem.solver.factor import CostlyError
from warpjld.fem.solver.krylov import Iteration, SolveStatus
from warpjld.fem.solver.linear import LinearSolver

__all__ = ["LaggedSolver"]

_INNER = 1e-4
"""Relative tolerance of iterative solves."""
_MOST = 150
"""Most iterations of a non-symmetric solve with a new preconditioner."""
_PATIENCE = 25
"""Most iterations with a preconditioner of an earlier matrix, before a new one is made."""
_BESIDE = 80
"""Most iterations of a non-symmetric solve preconditioned by a factor of K; the non-symmetric part has low rank."""
_WORK, _PROFILE = 2e5, 4e6
"""Multiplications per degree of freedom up to which a factor is cheaper than multigrid iterations (that of a ball is
not from a few thousand nodes on, that of fingers and shells is); and the bound on a quick estimate above which an
elimination order is not looked for. The estimate is that of a ball, but up to nine times that of a hand on a hollow
ball (25,617 degrees of freedom, 0.9e5 multiplications each: 0.3 s for the factor, 1.5 to 3 s for a solve without)."""


class LaggedSolver:
    """Linear solver for the successive, similar matrices of a contact problem.

    If a sparse factor of K is cheap, every matrix is factorised, and a non-symmetric part takes a few iterations.
    Otherwise, or if K is not positive definite, a multigrid preconditioner is reused as long as it converges quickly.

    Args:
        body: All bodies, merged.
        precision: ``float64``, or ``float32`` refined.
    """

    def __init__(self, body: Body, precision: str) -> None:
        self._options: dict[str, Any] = {"precision": precision, "threads": body.threads, "poisson": body.poisson}
        self._mesh = body.mesh
        self._hierarchy: list[Any] | None = None
        self._solver: LinearSolver | None = None
        self._direct: LinearSolver | None = None
        self._large = False

    def begin(self) -> None:
        """Start a load step: its first matrix gets a new preconditioner."""
        self._solver = None

    def solve(self, matrix: BlockMatrix, free: Mask, right: Array, nonsymmetric: Any = None) -> Iteration:
        """Solve K11 x = b for the free degrees of freedom, shape (3N,).

        ``nonsymmetric``, ``csr_array`` (3N, 3N), is added to K; the solve is then preconditioned by K. If K is not
        positive definite, the status is ``INDEFINITE``.
        """
        try:
            return self._solved(matrix, free, right, nonsymmetric)
        except IndefiniteError:
            return Iteration(np.zeros_like(right), SolveStatus.INDEFINITE, 0, 1.0, np.empty(0))

    def _solved(self, matrix: BlockMatrix, free: Mask, right: Array, nonsymmetric: Any) -> Iteration:
        factor = self._factor(matrix, free)
        if factor is not None:
            if nonsymmetric is None:
                return factor.solve(right)
            # no other preconditioner would do better: if this does not converge, the inexact step is used
            return factor.solve_nonsymmetric(nonsymmetric, right, tolerance=_INNER, iterations=_BESIDE)
        if nonsymmetric is not None:
            return self._nonsymmetric(matrix, free, right, nonsymmetric)
        sofar = None
        if self._solver is not None:
            before = self._solver.of(matrix)
            done = before.solve(right, tolerance=_INNER, iterations=_PATIENCE)
            if done.status is SolveStatus.CONVERGED:
                return done
            if done.status is SolveStatus.MAX_ITERATIONS and done.residual < 1.0:
                sofar = done
                left = right - before.masked_product(done.x)
        solver = self._new(matrix, free)
        if sofar is not None:  # continue from the result with the old preconditioner
            done = solver.solve(left, tolerance=_INNER / sofar.residual)
            done = replace(done, x=done.x + sofar.x, iterations=done.iterations + sofar.iterations)
        else:
            done = solver.solve(right, tolerance=_INNER)
        return self._kept(solver, done)

    def _factor(self, matrix: BlockMatrix, free: Mask) -> LinearSolver | None:
        """A direct solver; None if it costs too much, or K is not positive definite."""
        active, degrees = np.asarray(free.reshape(-1, 3).any(axis=1)), int(free.sum())
        if self._direct is None and not self._large:
            self._large = work_by_profile(matrix.rows, matrix.columns, active) > _PROFILE * degrees
        if self._large:
            return None
        options = {**self._options, "reuse": self._direct, "most": _WORK * degrees}
        try:
            self._direct = LinearSolver(matrix, free, self._mesh, method="direct", **options)
        except IndefiniteError:
            return None
        except CostlyError:
            self._direct, self._large = None, True
            return None
        return self._direct

    def _nonsymmetric(self, matrix: BlockMatrix, free: Mask, right: Array, nonsymmetric: Any) -> Iteration:
        if self._solver is not None:
            before = self._solver.over(matrix)
            done = before.solve_nonsymmetric(nonsymmetric, right, tolerance=_INNER, iterations=_PATIENCE)
            if done.status is SolveStatus.CONVERGED:
                return done
        solver = self._new(matrix, free)
        done = solver.over(matrix).solve_nonsymmetric(nonsymmetric, right, tolerance=_INNER, iterations=_MOST)
        return self._kept(solver, done)

    def _new(self, matrix: BlockMatrix, free: Mask) -> LinearSolver:
        return LinearSolver(matrix, free, self._mesh, hierarchy=self._hierarchy, **self._options)

    def _kept(self, solver: LinearSolver, done: Iteration) -> Iteration:
        self._solver, self._hierarchy = solver, solver.hierarchy
        return done
