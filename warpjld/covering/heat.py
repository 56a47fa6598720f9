"""Robust sparse solvers for stationary and implicit heat diffusion over surfaces."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.laplacian import cotangents
from warpjld.geometry.spatial_order import spatial_order
from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.threads import cores, in_threads, one_blas_thread, threads_for

if TYPE_CHECKING:
    import scipy.sparse as sp
    import scipy.sparse.linalg as linalg
else:
    sp = lazy_module("scipy.sparse")
    linalg = lazy_module("scipy.sparse.linalg")

__all__ = ["DiffusionFactor", "columns_together", "diffused", "solve_diffusion"]

_Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Solutions of right-hand sides, shape (V, n)."""

# vertices up to which a sparse factorisation is used: with 60 right-hand sides it is far faster than multigrid; beyond,
# its memory (1.5 kB a vertex) is too large
_DIRECT_LIMIT = 1_500_000
_BLOCK = 2_000_000  # values solved for at once: less memory is used again, more is asked of the system anew each time
_THREAD = 100_000  # smallest number of unknowns times right-hand sides worth a thread of its own
_TOLERANCE = 1e-7  # residual at which iterative solvers stop, relative to the right-hand side
_ACCEPTED = 1e-5  # largest relative residual of an accepted solution
_MULTIGRID_STEPS = 200  # iteration limit
_PLAIN_STEPS = 5_000  # iteration limit of conjugate gradients without multigrid


def solve_diffusion(
    matrix: sp.sparray, right: sp.sparray | NDArray[np.float64], order: NDArray[np.int64] | None = None
) -> NDArray[np.float64] | None:
    """Solve A X = B for a symmetric, diagonally dominant A with a positive diagonal.

    The system is scaled to a unit diagonal, so that tiny and huge triangles have equal influence on residuals. Small
    systems are factorised; large ones are solved by multigrid, and by conjugate gradients where that or the
    factorisation fails, with bounded numbers of iterations. Columns are solved some at a time, and do not depend on
    how many: beside X, memory does not grow with their number.

    Args:
        matrix: A, shape (V, V).
        right: B, shape (V, n), sparse or dense.
        order: Permutation that brings neighbouring rows together (``geometry.spatial_order``), which makes it faster.

    Returns:
        X, shape (V, n), or None where no solver reached the accepted residual.
    """
    rows = np.arange(matrix.shape[0]) if order is None else order
    if order is not None:
        matrix, right = sp.csr_array(matrix)[order][:, order], sp.csr_array(right)[order]
    diagonal = matrix.diagonal()
    if not (np.isfinite(matrix.data).all() and (diagonal > 0.0).all()):
        return None
    scale, scaled = _unit_diagonal(matrix)
    goal = sp.csc_array(sp.diags_array(scale) @ right)
    solvers = (_direct, _plain) if len(scale) <= _DIRECT_LIMIT else (_multigrid, _plain)
    for solver in solvers:
        # the solvers' own warnings do not help users; success is judged by the residual
        with warnings.catch_warnings(), np.errstate(all="ignore"), one_blas_thread():
            warnings.simplefilter("ignore")
            try:
                found = _columns(solver(scaled, scale), scaled, goal, scale, rows)
            except (RuntimeError, ArithmeticError, np.linalg.LinAlgError, ValueError):
                continue
        if found is not None:
            return found
    return None


def columns_together(count: int) -> int:
    """Right-hand sides of ``count`` rows that are solved at once: whole blocks of the kernel's, one a core at least."""
    from warpjld_kernels.symmetric_solve import TOGETHER

    return TOGETHER * max(_BLOCK // (TOGETHER * count), cores())


def _columns(
    solve: _Solve, matrix: sp.csc_array, goal: sp.csc_array, scale: NDArray[np.float64], rows: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Solutions in the rows ``rows``, some columns at a time; None where one's residual is too large."""
    out = np.empty(goal.shape)
    together = columns_together(len(rows))
    for first in range(0, goal.shape[1], together):
        right = goal[:, first : first + together].toarray()
        found = solve(right)
        residual = np.linalg.norm(matrix @ found - right, axis=0)
        accepted = _ACCEPTED * np.linalg.norm(right, axis=0) + 1e-300
        if not (np.isfinite(found).all() and (residual <= accepted).all()):
            return None
        out[rows, first : first + together] = scale[:, None] * found
    return out


def _unit_diagonal(matrix: sp.sparray) -> tuple[NDArray[np.float64], sp.csc_array]:
    """S with S A S of unit diagonal, as its diagonal (V,), and S A S."""
    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = sp.csc_array(matrix, copy=True)
    scaled.sort_indices()
    scaled.data = scale[scaled.indices] * scaled.data * np.repeat(scale, np.diff(scaled.indptr))
    return scale, scaled


def diffused(
    values: NDArray[np.float64],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    tau: NDArray[np.float64],
) -> NDArray[np.float64]:
    """One field after heat diffusion over a surface in two implicit steps, shape (V,).

    Without the conductivity around saddle vertices. A field that cannot be diffused is left as it is.

    Args:
        values: The field, shape (V,).
        vertices: Vertex positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        tau: Square of the diffusion length at every vertex [m²], shape (V,).
    """
    laplacian, area = cotangents(vertices, faces, lambda i, j: (tau[i] + tau[j]) / 4.0)
    order = spatial_order(vertices)
    matrix = sp.csr_array(sp.diags_array(area) + laplacian)[order][:, order]
    out = values.copy()
    if not np.isfinite(matrix.data).all():
        return values
    try:
        out[order] = DiffusionFactor(matrix).solve(values[order, None], weight=area[order], times=2)[:, 0]
    except (ArithmeticError, RuntimeError):
        return values
    return out if np.isfinite(out).all() else values


class DiffusionFactor:
    """Factorisation of a symmetric, diagonally dominant matrix for many right-hand sides.

    SuperLU factorises; triangular solves are done by a kernel, which takes a third of SuperLU's time for many
    right-hand sides, and uses several threads.

    Raises:
        ArithmeticError: The diagonal does not dominate.
    """

    def __init__(self, matrix: sp.sparray) -> None:
        scale, scaled = _unit_diagonal(matrix)
        with one_blas_thread():
            factors = _factorised(scaled)
        # without pivoting U = D Lᵀ, and rows are permuted as columns are
        if not np.array_equal(factors.perm_r, factors.perm_c):
            raise ArithmeticError("matrix: its diagonal does not dominate")
        self._place = factors.perm_c.astype(np.int64)  # row of each unknown in the factor
        lower, upper = factors.L, factors.U
        lower.sort_indices()
        self._first, self._row, self._lower = lower.indptr, lower.indices, lower.data
        self._diagonal = upper.diagonal()
        self._scale = np.empty_like(scale)
        self._scale[self._place] = scale

    def solve(
        self, right: NDArray[np.float64], *, weight: NDArray[np.float64] | None = None, times: int = 1
    ) -> NDArray[np.float64]:
        """Solve A X = B, shape (V, n); or give (A⁻¹ W)^times B with a diagonal matrix W of weights, shape (V,)."""
        import warp as wp
        from warpjld_kernels.symmetric_solve import TOGETHER, solve_symmetric

        count, columns = right.shape
        blocks = -(-columns // TOGETHER)
        values = np.zeros((blocks, count, TOGETHER))
        for block in range(blocks):  # a block at a time: single columns would touch each line of memory
            some = right[:, block * TOGETHER : (block + 1) * TOGETHER]
            values[block, self._place, : some.shape[1]] = some
        before = self._scale.copy()
        if weight is not None:
            before[self._place] *= weight
        places = [wp.array(a, dtype=wp.int32, device="cpu", copy=False) for a in (self._first, self._row)]
        numbers = (self._lower, self._diagonal, before, self._scale)
        inputs = [*places, *(wp.array(a, dtype=wp.float64, device="cpu", copy=False) for a in numbers)]
        where = wp.array(values, dtype=wp.float64, device="cpu", copy=False)

        def span(begin: int, end: int) -> None:
            wp.launch(
                solve_symmetric, dim=end - begin, inputs=[*inputs, times], outputs=[where[begin:end]], device="cpu"
            )

        in_threads(span, blocks, threads_for(values.size, _THREAD), solve_symmetric, "cpu")
        out = np.empty((count, columns))
        for block in range(blocks):
            some = out[:, block * TOGETHER : (block + 1) * TOGETHER]
            some[...] = values[block, self._place, : some.shape[1]]
        return out


@contextmanager
def _fixed_random_state() -> Iterator[None]:
    """Fix the seed of NumPy's global generator, which pyamg draws from, and restore its state afterwards."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def _direct(matrix: sp.csc_array, scale: NDArray[np.float64]) -> _Solve:
    try:
        return DiffusionFactor(matrix).solve
    except ArithmeticError:  # rows had to be exchanged
        solve: _Solve = _factorised(matrix).solve
        return solve


def _factorised(matrix: sp.csc_array) -> linalg.SuperLU:
    """LU factors of a diagonally dominant matrix, without row pivoting."""
    return linalg.splu(matrix, diag_pivot_thresh=0.0, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def _multigrid(matrix: sp.csc_array, scale: NDArray[np.float64]) -> _Solve:
    import pyamg

    # near-nullspace candidate: constants, which are 1 / scale in the scaled unknowns
    with _fixed_random_state():
        hierarchy = pyamg.smoothed_aggregation_solver(sp.csr_matrix(matrix), B=(1.0 / scale)[:, None])

    def solve(right: NDArray[np.float64]) -> NDArray[np.float64]:
        out = np.empty_like(right)
        for k, b in enumerate(right.T):
            out[:, k], info = hierarchy.solve(b, tol=_TOLERANCE, accel="cg", maxiter=_MULTIGRID_STEPS, return_info=True)
            if info:  # a single column that does not converge is enough to try the next solver
                raise ArithmeticError("multigrid did not converge")
        return out

    return solve


def _plain(matrix: sp.csc_array, scale: NDArray[np.float64]) -> _Solve:
    apply = linalg.LinearOperator(matrix.shape, matvec=matrix.tocsr().dot, dtype=np.float64)

    def solve(right: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = [linalg.cg(apply, b, rtol=_TOLERANCE, atol=0.0, maxiter=_PLAIN_STEPS)[0] for b in right.T]
        return np.column_stack(columns)

    return solve
