"""Multigrid preconditioner: Galerkin coarse operators, Chebyshev smoothing, a direct solve on the coarsest level.

Set up in float64, applied in float32 (or float64): a preconditioner need not be exact, and half the memory traffic is
half the time. The cycle is symmetric and positive definite, as conjugate gradients require.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded
from scipy.sparse import bsr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError, padded
from warpjld.fem.assembly.pattern import triple_product
from warpjld.fem.launch import Launch, grouped, on_rows, shared, threads_of
from warpjld.fem.solver.smoother import block_inverse, chebyshev_steps, highest_eigenvalue

__all__ = ["Aggregation", "Multigrid", "coarse_matrix", "restriction"]


def coarse_matrix(fine: BlockMatrix, free: Mask, weights: Any, transposed: Any, *, threads: int) -> BlockMatrix:
    """Galerkin coarse operator Pᵀ K11 P, float64.

    Args:
        fine: Full matrix K, N block rows.
        free: Mask of free degrees of freedom, shape (3N,); others are left out.
        weights: Prolongation P with one weight for the three components of a node, ``csr_array`` (N, n).
        transposed: Pᵀ, see ``restriction``.
        threads: Number of threads.
    """
    from warpjld_kernels import fem_galerkin

    down, up = (transposed.indptr, transposed.indices), (weights.indptr, weights.indices)
    product = triple_product(down, (fine.rows, fine.columns), up, weights.shape[1], threads=threads)
    values = np.zeros((len(product.columns), 3, 3))
    arguments = [
        shared(product.ranges),
        grouped(fem_galerkin.Blocks, rows=fine.rows, columns=fine.columns, values=fine.values.reshape(-1)),
        shared(free.astype(np.float64)),
        *(
            grouped(fem_galerkin.Weights, rows=w.indptr, columns=w.indices, weights=w.data)
            for w in (weights, transposed)
        ),
        shared(product.marker),
        grouped(fem_galerkin.Blocks, rows=product.rows, columns=product.columns, values=values.reshape(-1)),
    ]
    on_rows(fem_galerkin.coarse_values, len(product.ranges) - 1, arguments, threads=threads, least=2)
    return BlockMatrix(product.rows, product.columns, values)


def restriction(weights: Any) -> Any:
    """Pᵀ as ``csr_array`` with 32-bit indices, as the kernels need them."""
    out = weights.T.tocsr()
    out.indices = out.indices.astype(np.int32)
    out.indptr = out.indptr.astype(np.int32)
    return out


@dataclass(frozen=True, eq=False)
class _Level:
    """Launches of a level, before and after the coarser level; ``b`` is its input, ``x`` its result."""

    before: list[Launch]
    after: list[Launch]
    b: NDArray[Any]
    x: NDArray[Any]


class Multigrid:
    """A symmetric V-cycle z = M r.

    Args:
        stiffness: Full matrix K, float64.
        free: Mask of free degrees of freedom, shape (3N,).
        hierarchy: Prolongations, finest first (see ``hierarchy_of``).
        degree: Degree of the Chebyshev smoother before and after each coarse correction.
        spread: Ratio of the largest to the smallest eigenvalue that smoothing is made for.
        precision: ``float32`` or ``float64``.
        threads: Number of threads; all by default.

    Raises:
        IndefiniteError: A coarse operator is not positive definite.
    """

    def __init__(
        self,
        stiffness: BlockMatrix,
        free: Mask,
        hierarchy: list[Any],
        *,
        degree: int = 2,
        spread: float = 8.0,
        precision: str = "float32",
        threads: int | None = None,
    ) -> None:
        self.threads = threads_of(threads)
        self._type = np.dtype(precision)
        self._free = free.astype(self._type)
        matrices = [(stiffness, free)]
        transposes = [restriction(weights) for weights in hierarchy]
        for weights, transposed in zip(hierarchy, transposes, strict=True):
            coarse = coarse_matrix(*matrices[-1], weights, transposed, threads=self.threads)
            matrices.append((coarse, np.ones(3 * coarse.size, dtype=bool)))
        self._coarsest = _Coarsest(*matrices[-1])
        sides = [padded(3 * matrix.size, self._type) for matrix, _ in matrices]
        self._below = sides[-1]
        self._answer = padded(len(sides[-1]), self._type)
        self._levels: list[_Level] = []
        correction = self._answer
        for k in reversed(range(len(hierarchy))):
            level = self._level(
                *matrices[k], hierarchy[k], transposes[k], sides[k], sides[k + 1], correction, degree, spread
            )
            correction = level.x
            self._levels.insert(0, level)

    def _level(
        self,
        matrix: BlockMatrix,
        free: Mask,
        weights: Any,
        transposed: Any,
        b: NDArray[Any],
        below: NDArray[Any],
        correction: NDArray[Any],
        degree: int,
        spread: float,
    ) -> _Level:
        from warpjld_kernels import fem_blocks

        kind, count = self._type, matrix.size
        inverse = block_inverse(matrix, free).astype(kind)
        plain = matrix.masked(free, kind)
        highest = 1.1 * highest_eigenvalue(plain, inverse, self.threads)
        table = plain.arguments
        inverted = shared(inverse.reshape(-1))
        step, *pair = (shared(padded(3 * count, kind)) for _ in range(3))
        right = shared(b)

        def launch(kernel: Any, rows: int, *arguments: Any) -> Launch:
            return Launch(kernel, rows, list(arguments), threads=self.threads)

        scalar = table[2].dtype
        before, after = [], []
        current = 0
        for k, (momentum, scale) in enumerate(chebyshev_steps(degree, highest / spread, highest)):
            values = scalar(momentum), scalar(scale)
            if k == 0:
                before.append(launch(fem_blocks.first_step, count, inverted, values[1], right, step, pair[0]))
            else:
                arguments = [*table, inverted, *values, right, pair[current], step, pair[1 - current]]
                before.append(launch(fem_blocks.chebyshev_step, count, *arguments))
                current = 1 - current
        before.append(launch(fem_blocks.residual, count, *table, right, pair[current], step))
        down = [shared(transposed.indptr), shared(transposed.indices), shared(transposed.data.astype(kind))]
        before.append(launch(fem_blocks.interpolate, weights.shape[1], *down, False, step, shared(below)))
        up = [shared(weights.indptr), shared(weights.indices), shared(weights.data.astype(kind))]
        after.append(launch(fem_blocks.interpolate, count, *up, True, shared(correction), pair[current]))
        for momentum, scale in chebyshev_steps(degree, highest / spread, highest):
            values = scalar(momentum), scalar(scale)
            arguments = [*table, inverted, *values, right, pair[current], step, pair[1 - current]]
            after.append(launch(fem_blocks.chebyshev_step, count, *arguments))
            current = 1 - current
        return _Level(before, after, b, pair[current].numpy())

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self._levels) + 1

    def __call__(self, r: NDArray[Any]) -> NDArray[Any]:
        """Apply the preconditioner: z = M r, shape (3N,), in the type of ``r``."""
        if not self._levels:
            return self._coarsest.solve(r).astype(r.dtype)
        self._levels[0].b[:] = r
        for level in self._levels:
            for launch in level.before:
                launch()
        self._answer[:] = self._coarsest.solve(self._below)
        for level in reversed(self._levels):
            for launch in level.after:
                launch()
        return (self._levels[0].x * self._free).astype(r.dtype)


class _Coarsest:
    """Banded Cholesky factor of the coarsest level, in Cuthill–McKee order."""

    def __init__(self, matrix: BlockMatrix, free: Mask) -> None:
        self.size = matrix.size
        plain = matrix.masked(free).to_scipy().tocsr()
        diagonal = plain.diagonal()
        top = float(np.abs(diagonal).max(initial=1e-300))
        idle = np.abs(diagonal) <= 1e-13 * top
        plain.eliminate_zeros()
        self._order = reverse_cuthill_mckee(plain, symmetric_mode=True)
        entries = plain[self._order][:, self._order].tocoo()
        lower = entries.row >= entries.col
        row, column, data = entries.row[lower], entries.col[lower], entries.data[lower]
        band = int((row - column).max(initial=0))
        table = np.zeros((band + 1, len(diagonal)))
        table[row - column, column] = data
        table[0] += np.where(idle[self._order], top, 1e-12 * np.abs(table[0]))
        try:
            self._factor = cholesky_banded(table, lower=True, check_finite=False, overwrite_ab=True)
        except LinAlgError as error:
            raise IndefiniteError("the stiffness is not positive definite (found on the coarsest level)") from error

    def solve(self, b: NDArray[Any]) -> Array:
        out = np.empty(len(self._order))
        out[self._order] = cho_solve_banded((self._factor, True), b[self._order].astype(np.float64), check_finite=False)
        return out


class Aggregation:
    """A V-cycle of smoothed aggregation.

    Args:
        stiffness: Full K, float64.
        free: Mask of free degrees of freedom, shape (3N,).
        nodes: Rest positions [m], shape (N, 3), for the rigid-body modes.
    """

    def __init__(self, stiffness: BlockMatrix, free: Mask, nodes: Array) -> None:
        import pyamg

        from warpjld.fem.load.prescribed import rigid_modes

        matrix = stiffness.masked(free)
        diagonal = np.einsum("nii->ni", matrix.diagonal())
        on = matrix.on_diagonal
        # prescribed degrees of freedom stay in the matrix, decoupled by a diagonal entry
        matrix.values[on[:, None], [0, 1, 2], [0, 1, 2]] += ~free.reshape(-1, 3) * diagonal.max()
        modes = rigid_modes(nodes) * free[:, None]
        n = 3 * matrix.size
        self._free = free
        self._levels = pyamg.smoothed_aggregation_solver(
            bsr_matrix((matrix.values, matrix.columns, matrix.rows), shape=(n, n)), B=modes, max_coarse=500
        )
        self._apply = self._levels.aspreconditioner(cycle="V")

    def __call__(self, r: NDArray[Any]) -> NDArray[Any]:
        """Apply the preconditioner: z = M r, shape (3N,)."""
        result: NDArray[Any] = (self._apply @ r.astype(np.float64)) * self._free
        return result.astype(r.dtype)
