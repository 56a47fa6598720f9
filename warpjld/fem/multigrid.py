"""Multigrid as a preconditioner: Galerkin coarse operators, Chebyshev smoothing, a direct solve on the coarsest level.

Built in float64, applied in float32 (or float64): a preconditioner need not be exact, and half the bytes are half the
time. The cycle is symmetric and positive, so it preconditions conjugate gradients.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import WarpjldError
from warpjld.fem.blockmatrix import BlockMatrix, padded
from warpjld.fem.dots import dot
from warpjld.fem.rows import Launch, grouped, on_rows, shared, threads_of

__all__ = ["IndefiniteError", "Multigrid", "block_inverse", "coarse_matrix"]


class IndefiniteError(WarpjldError):
    """A matrix that should be positive definite is not."""


def coarse_matrix(
    fine: BlockMatrix, free: NDArray[np.bool_], weights: Any, transposed: Any, *, threads: int
) -> BlockMatrix:
    """Pᵀ K11 P, float64; prescribed degrees of freedom (not ``free``, shape (3N,)) do not take part."""
    from warpjld_kernels import fem_galerkin

    count = weights.shape[1]
    work = np.concatenate([[0], np.cumsum(np.diff(transposed.indptr))])
    parts = threads if count >= 64 else 1
    edges = np.searchsorted(work, np.linspace(0, work[-1], parts + 1)).astype(np.int32)
    edges[0], edges[-1] = 0, count
    rows = np.zeros(count + 1, np.int32)
    ranges, mask = shared(edges), shared(free.astype(np.float64))
    model = grouped(fem_galerkin.Blocks, rows=fine.rows, columns=fine.columns, values=fine.values.reshape(-1))
    up, down = (
        grouped(fem_galerkin.Weights, rows=w.indptr, columns=w.indices, weights=w.data) for w in (weights, transposed)
    )
    marker = np.full((parts, count), -1, np.int32)
    table = shared(marker)
    coarse = grouped(fem_galerkin.Blocks, rows=rows, columns=np.zeros(1, np.int32), values=np.zeros(1))
    arguments = [ranges, False, model, up, down, table, coarse]
    on_rows(fem_galerkin.coarse_pattern, parts, arguments, threads=threads, least=2)
    np.cumsum(rows, out=rows)
    columns, values = np.empty(rows[-1], np.int32), np.zeros((rows[-1], 3, 3))
    coarse = grouped(fem_galerkin.Blocks, rows=rows, columns=columns, values=values.reshape(-1))
    marker.fill(-1)
    arguments = [ranges, True, model, up, down, table, coarse]
    on_rows(fem_galerkin.coarse_pattern, parts, arguments, threads=threads, least=2)
    arguments = [ranges, model, mask, up, down, table, coarse]
    on_rows(fem_galerkin.coarse_values, parts, arguments, threads=threads, least=2)
    return BlockMatrix(rows, columns, values)


def block_inverse(matrix: BlockMatrix, free: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
    """Inverses of the diagonal blocks, zero where a degree of freedom is prescribed or has no stiffness, (N, 3, 3).

    Raises:
        IndefiniteError: A diagonal block with a negative stiffness.
    """
    blocks = matrix.diagonal().astype(np.float64)
    diagonal = np.einsum("nii->ni", blocks)
    if (diagonal < 0).any():
        node, axis = np.argwhere(diagonal < 0)[0]
        raise IndefiniteError(
            f"node {node} has the negative stiffness {diagonal[node, axis]:.3g} N/m along {'xyz'[axis]}"
        )
    on = diagonal > 1e-13 * diagonal.max(initial=0.0)
    if free is not None:
        on &= free.reshape(-1, 3)
    blocks = blocks * (on[:, :, None] & on[:, None, :])
    blocks[:, [0, 1, 2], [0, 1, 2]] += ~on
    inverse: NDArray[np.float64] = np.linalg.inv(blocks)
    return inverse * (on[:, :, None] & on[:, None, :])


@dataclass(frozen=True, eq=False)
class _Level:
    """A level's launches: before the coarser level, and after it; ``x`` is where the result is."""

    before: list[Launch]
    after: list[Launch]
    b: NDArray[Any]
    x: NDArray[Any]


class Multigrid:
    """One symmetric V-cycle z = M r.

    Args:
        stiffness: Full matrix K, float64.
        free: Free degrees of freedom, shape (3N,).
        hierarchy: Interpolation weights, finest first (see ``hierarchy_of``).
        degree: Chebyshev degree before and after each coarse correction.
        spread: Highest over lowest eigenvalue that smoothing takes care of.
        precision: ``float32`` or ``float64``.
        threads: Threads, by default all.

    Raises:
        IndefiniteError: A coarse operator is not positive definite.
    """

    def __init__(
        self,
        stiffness: BlockMatrix,
        free: NDArray[np.bool_],
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
        transposes = [_transpose(weights) for weights in hierarchy]
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
        free: NDArray[np.bool_],
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
        highest = 1.1 * _highest(plain, inverse, self.threads)
        table = plain.arguments
        inverted = shared(inverse.reshape(-1))
        step, *pair = (shared(padded(3 * count, kind)) for _ in range(3))
        right = shared(b)

        def launch(kernel: Any, rows: int, *arguments: Any) -> Launch:
            return Launch(kernel, rows, list(arguments), threads=self.threads)

        scalar = table[2].dtype
        before, after = [], []
        current = 0
        for k, (momentum, scale) in enumerate(_chebyshev(degree, highest / spread, highest)):
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
        for momentum, scale in _chebyshev(degree, highest / spread, highest):
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
        """z = M r, shape (3N,), in the type of ``r``."""
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


def _chebyshev(degree: int, low: float, high: float) -> list[tuple[float, float]]:
    """Momentum and scale of each step of the Chebyshev polynomial over [low, high]."""
    centre, half = 0.5 * (high + low), 0.5 * (high - low)
    sigma = centre / half
    rho = 1.0 / sigma
    steps = [(0.0, 1.0 / centre)]
    for _ in range(degree - 1):
        following = 1.0 / (2.0 * sigma - rho)
        steps.append((following * rho, 2.0 * following / half))
        rho = following
    return steps


class _Coarsest:
    """Banded Cholesky of the coarsest level, in the ordering of Cuthill and McKee."""

    def __init__(self, matrix: BlockMatrix, free: NDArray[np.bool_]) -> None:
        from scipy.linalg import LinAlgError, cholesky_banded
        from scipy.sparse.csgraph import reverse_cuthill_mckee

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

    def solve(self, b: NDArray[Any]) -> NDArray[np.float64]:
        from scipy.linalg import cho_solve_banded

        out = np.empty(len(self._order))
        out[self._order] = cho_solve_banded((self._factor, True), b[self._order].astype(np.float64), check_finite=False)
        return out


def _highest(matrix: BlockMatrix, inverse: NDArray[Any], threads: int, rounds: int = 16) -> float:
    """Highest eigenvalue of D⁻¹A, from a fixed start: Lanczos, by way of conjugate gradients' coefficients.

    A few badly shaped elements make a few high eigenvalues far apart from the rest; the power method finds them too
    late, and a smoother that does not know them amplifies them.
    """
    kind = matrix.values.dtype
    rng = np.random.default_rng(0)

    def scaled(v: NDArray[Any]) -> NDArray[Any]:
        return np.einsum("nij,nj->ni", inverse, v.reshape(-1, 3)).ravel()

    r = rng.uniform(-1.0, 1.0, 3 * matrix.size).astype(kind)
    z = scaled(r)
    p, rz = z, dot(r, z)
    diagonal, beside = [], []
    ratio, before = 0.0, 1.0
    for _ in range(rounds):
        q = matrix.product(p, threads=threads)
        curvature = dot(p, q)
        if not (curvature > 0.0 and rz > 0.0):
            break
        alpha = rz / curvature
        diagonal.append(1.0 / alpha + ratio / before)
        r = r - kind.type(alpha) * q
        z = scaled(r)
        ratio, rz = dot(r, z) / rz, dot(r, z)
        beside.append(np.sqrt(max(ratio, 0.0)) / alpha)
        p = z + kind.type(ratio) * p
        before = alpha
    if not diagonal:
        return 1.0
    from scipy.linalg import eigh_tridiagonal

    return float(eigh_tridiagonal(np.array(diagonal), np.array(beside[:-1]), eigvals_only=True)[-1])


def _transpose(weights: Any) -> Any:
    out = weights.T.tocsr()
    out.indices = out.indices.astype(np.int32)
    out.indptr = out.indptr.astype(np.int32)
    return out
