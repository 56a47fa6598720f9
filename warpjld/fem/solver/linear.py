"""Linear solver for K11 U_u = R_k − K12 U_k (B eq. 7), for a mesh and its prescribed degrees of freedom."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Mask, norm
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError, padded
from warpjld.fem.launch import Launch, shared, threads_of
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.solver.factor import Factor
from warpjld.fem.solver.hierarchy import hierarchy_of
from warpjld.fem.solver.krylov import Iteration, SolveStatus, conjugate_gradients, minimal_residuals
from warpjld.fem.solver.multigrid import Multigrid
from warpjld.fem.solver.smoother import block_inverse

__all__ = ["METHODS", "LinearSolver"]

METHODS = ("auto", "multigrid", "aggregation", "jacobi", "direct")
PRECISIONS = ("float64", "float32")
_SMALL = 1500
"""Number of degrees of freedom below which ``auto`` uses a direct solver."""
_STIFF = 0.4
"""Poisson's ratio above which stronger smoothing is used."""


class LinearSolver:
    """Solves with one stiffness matrix for any number of right-hand sides.

    Args:
        stiffness: Full K, float64.
        free: Mask of free degrees of freedom, shape (3N,).
        mesh: Mesh, for the multigrid hierarchy.
        method: ``multigrid`` (geometric if the mesh allows it, otherwise on a regular grid around it),
            ``aggregation`` (smoothed aggregation with rigid-body modes, from pyamg), ``jacobi`` (3×3 blocks),
            ``direct`` (sparse Cholesky factor, or SuperLU), or ``auto``.
        precision: ``float64``, or ``float32`` with float64 iterative refinement.
        poisson: Largest Poisson's ratio, which decides on smoothing.
        hierarchy: Prolongations of an earlier solver for the same mesh.
        reuse: An earlier solver that is no longer needed: its factor is overwritten.
        definite: Whether ``direct`` requires a positive definite matrix.
        most: Largest number of multiplications of a Cholesky factor.
        threads: Number of threads; all by default.

    Raises:
        IndefiniteError: Found during set-up.
        CostlyError: The Cholesky factor takes more multiplications than ``most``.
        InputError: Unknown method.
    """

    def __init__(
        self,
        stiffness: BlockMatrix,
        free: Mask,
        mesh: HexMesh,
        *,
        method: str = "auto",
        precision: str = "float64",
        poisson: float = 0.3,
        hierarchy: list[Any] | None = None,
        reuse: LinearSolver | None = None,
        definite: bool = True,
        most: float = np.inf,
        threads: int | None = None,
    ) -> None:
        if method not in METHODS:
            raise InputError(f"method: want one of {', '.join(METHODS)}, got '{method}'")
        if precision not in PRECISIONS:
            raise InputError(f"precision: want {' or '.join(PRECISIONS)}, got '{precision}'")
        if method == "auto":
            method = "direct" if int(free.sum()) < _SMALL else "multigrid"
        self.method = method
        self.threads = threads_of(threads)
        self.free = free
        self.hierarchy = hierarchy
        self._precision = precision
        self._stiffness = stiffness
        self._mesh = mesh
        self._mask = free.astype(np.float64)
        self._product = _Product(stiffness, self.threads)
        self._precondition: Callable[[NDArray[Any]], NDArray[Any]]
        if method == "multigrid":
            if hierarchy is None:
                self.hierarchy = hierarchy_of(mesh)
            degree, spread = (8, 50.0) if poisson > _STIFF else (2, 5.0)
            assert self.hierarchy is not None
            self._precondition = Multigrid(
                stiffness, free, self.hierarchy, degree=degree, spread=spread, threads=self.threads
            )
        elif method == "aggregation":
            from warpjld.fem.solver.multigrid import Aggregation

            self._precondition = Aggregation(stiffness, free, mesh.nodes)
        elif method == "jacobi":
            inverse = block_inverse(stiffness, free)
            self._precondition = lambda r: np.einsum("nij,nj->ni", inverse, r.reshape(-1, 3)).ravel().astype(r.dtype)
        elif definite and free.any():
            before = None if reuse is None else reuse.factor
            self._factor: Factor | _General = Factor(stiffness, free, threads=self.threads, reuse=before, most=most)
        else:
            self._factor = _General(stiffness, free)

    @property
    def factor(self) -> Factor | None:
        """Its Cholesky factor, if it has one."""
        return self._factor if self.method == "direct" and isinstance(self._factor, Factor) else None

    def of(self, stiffness: BlockMatrix) -> LinearSolver:
        """A solver for a matrix close to this one: a multigrid preconditioner is kept, a factor is recomputed."""
        if self.method == "direct":
            return LinearSolver(stiffness, self.free, self._mesh, method="direct", threads=self.threads)
        return self.over(stiffness)

    def over(self, stiffness: BlockMatrix) -> LinearSolver:
        """A solver for another matrix with the same preconditioner or factor."""
        out = copy(self)
        out._stiffness = stiffness
        out._product = _Product(stiffness, self.threads)
        return out

    def solve(self, b: Array, *, tolerance: float = 1e-8, iterations: int = 4000) -> Iteration:
        """U_u for a right-hand side (3N,), of which only the free part is used; zero where prescribed."""
        right = b * self._mask
        if self.method == "direct":
            return self._direct(right)
        if self._precision == "float64":
            return conjugate_gradients(
                self.masked_product, self._precondition, right, tolerance=tolerance, iterations=iterations
            )
        return self._refined(right, tolerance, iterations)

    def solve_nonsymmetric(
        self, nonsymmetric: Any, b: Array, *, tolerance: float = 1e-8, iterations: int = 400
    ) -> Iteration:
        """Solution of (K11 + E11) x = b by flexible GMRES, for a matrix E (3N, 3N) that may be nonsymmetric and
        indefinite; preconditioned as K is. With a factor of K, the unknowns are y = E x, non-zero in few rows.
        """
        right = b * self._mask
        mask = self._mask
        if self.method == "direct":
            return self._beside_factor(csr_array(nonsymmetric), right, tolerance, iterations)

        def product(x: Array) -> Array:
            return self.masked_product(x) + mask * (nonsymmetric @ x)

        def precondition(r: Array) -> Array:
            return np.asarray(self._precondition(r))

        return minimal_residuals(product, precondition, right, tolerance=tolerance, iterations=iterations)

    def _beside_factor(self, nonsymmetric: Any, right: Array, tolerance: float, iterations: int) -> Iteration:
        """Solution of (K11 + E11) x = b as x = K⁻¹ (b − y), (1 + E K⁻¹) y = E K⁻¹ b; both residuals are the same."""
        mask, solve = self._mask, self._factor.solve
        rows = np.flatnonzero(np.diff(nonsymmetric.indptr))
        part = nonsymmetric[rows]
        columns, at = np.unique(part.indices, return_inverse=True)
        inner = csr_array((part.data, at, part.indptr), shape=(len(rows), len(columns)))
        between = self._factor.between(rows, columns)

        def pushed(x: Array) -> Array:
            return np.asarray(mask[rows] * (inner @ x))

        x = solve(right)
        start, size = pushed(x[columns]), norm(right)
        aim = tolerance * size
        done = Iteration(start, SolveStatus.CONVERGED, 0, 0.0, np.empty(0))
        if not norm(start) <= aim:
            aim /= norm(start)
            done = minimal_residuals(
                lambda y: y + pushed(between(y)), lambda y: y, start, tolerance=aim, iterations=iterations
            )
            less = right.copy()
            less[rows] -= done.x
            x = solve(less)
        left = norm(right - self.masked_product(x) - mask * (nonsymmetric @ x)) / max(size, 1e-300)
        status = done.status if np.isfinite(left) else SolveStatus.NOT_FINITE
        return replace(done, x=x, status=status, residual=left)

    def masked_product(self, x: NDArray[Any]) -> NDArray[Any]:
        """Product K11 x."""
        y = self._product(x)
        y *= self._mask
        return y

    def _refined(self, b: Array, tolerance: float, iterations: int) -> Iteration:
        """Iterative refinement: float32 iterations to 1e-2 with residuals in float64."""
        single = self._stiffness.masked(self.free, np.float32)
        product = _Product(single, self.threads)
        x = np.zeros_like(b)
        size = norm(b)
        done = 0
        history: list[float] = []
        if size == 0.0:
            return Iteration(x, SolveStatus.CONVERGED, 0, 0.0, np.array(history))
        r, now = b, 1.0
        status = SolveStatus.MAX_ITERATIONS
        while done < iterations:
            inner = conjugate_gradients(
                product,
                self._precondition,
                (r / norm(r)).astype(np.float32),
                tolerance=1e-2,
                iterations=iterations - done,
            )
            done += max(1, inner.iterations)
            x = x + norm(r) * inner.x
            r = b - self.masked_product(x)
            before, now = now, norm(r) / size
            history.append(now)
            if inner.status in (SolveStatus.INDEFINITE, SolveStatus.NOT_FINITE) or not np.isfinite(now):
                status = inner.status
                break
            if now <= tolerance:
                status = SolveStatus.CONVERGED
                break
            if now > 0.9 * before:
                status = SolveStatus.STAGNATED
                break
        return Iteration(x, status, done, now, np.array(history))

    def _direct(self, b: Array) -> Iteration:
        size = norm(b)
        x = np.zeros_like(b)
        if not np.isfinite(size):
            return Iteration(x, SolveStatus.NOT_FINITE, 0, float("nan"), np.empty(0))
        if size == 0.0:
            return Iteration(x, SolveStatus.CONVERGED, 0, 0.0, np.empty(0))
        x = self._factor.solve(b)
        x = x + self._factor.solve(b - self.masked_product(x))
        residual = norm(b - self.masked_product(x)) / size
        if not np.isfinite(residual):
            return Iteration(x, SolveStatus.NOT_FINITE, 0, residual, np.empty(0))
        return Iteration(
            x, SolveStatus.CONVERGED if residual < 1e-6 else SolveStatus.INDEFINITE, 0, residual, np.empty(0)
        )


class _Product:
    """Product x → A x with preallocated buffers."""

    def __init__(self, matrix: BlockMatrix, threads: int) -> None:
        from warpjld_kernels import fem_blocks

        kind = matrix.values.dtype
        self._x = padded(3 * matrix.size, kind)
        self._y = padded(3 * matrix.size, kind)
        self._matrix = matrix
        arguments = [*matrix.arguments, shared(self._x), shared(self._y)]
        self._launch = Launch(fem_blocks.product, matrix.size, arguments, threads=threads)

    def __call__(self, x: NDArray[Any]) -> NDArray[Any]:
        self._x[:] = x
        self._launch()
        return self._y.copy()


class _General:
    """LU factors of a matrix that may be indefinite."""

    def __init__(self, stiffness: BlockMatrix, free: Mask) -> None:
        inside = stiffness.to_scipy().tocsr()[free][:, free].tocsc()
        options = {"SymmetricMode": True}
        try:
            self._factor = splu(inside, permc_spec="MMD_AT_PLUS_A", options=options, diag_pivot_thresh=0.1)
        except RuntimeError as error:
            raise IndefiniteError(f"the stiffness is singular: {error}") from error
        self._free = free

    def solve(self, right: Array) -> Array:
        """Solution of K11 x = b, zero where prescribed, shape (3N,)."""
        x = np.zeros_like(right)
        x[self._free] = self._factor.solve(right[self._free])
        return x

    def between(self, rows: Ints, columns: Ints) -> Callable[[Array], Array]:
        """As ``Factor.between``."""

        def solved(right: Array) -> Array:
            whole = np.zeros(len(self._free))
            whole[rows] = right
            return self.solve(whole)[columns]

        return solved
