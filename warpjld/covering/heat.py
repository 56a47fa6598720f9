"""Heat at rest on a triangulated surface: the equations, and a solver that ends whatever the mesh is like."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.corners import corner_conductivity
from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.threads import in_threads, one_blas_thread, threads_for

if TYPE_CHECKING:
    import scipy.sparse as sp
    import scipy.sparse.linalg as linalg
else:
    sp = lazy_module("scipy.sparse")
    linalg = lazy_module("scipy.sparse.linalg")

__all__ = [
    "DiffusionFactor",
    "conducting_laplacian",
    "cotangent_laplacian",
    "solve_diffusion",
    "spatial_order",
    "uniform_laplacian",
]

# vertices up to which a sparse factorisation is taken: with 60 right-hand sides it is far quicker than multigrid, and
# beyond its memory counts (1.5 kB a vertex)
_DIRECT_LIMIT = 1_500_000
_THREAD = 100_000  # unknowns times right-hand sides that a thread must have to solve for
_BITS = 16  # of each coordinate in a place on the curve
_TOLERANCE = 1e-7  # residual of the iterative solvers, and
_ACCEPTED = 1e-5  # of a solution that is taken, both relative to the right-hand side
_MULTIGRID_STEPS = 200
_PLAIN_STEPS = 5_000


def cotangent_laplacian(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], thickness: NDArray[np.float64]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Positive semidefinite cotangent Laplacian and barycentric vertex areas.

    Cotangents are kept within (0, 1e3): a weight of the wrong sign would let heat run uphill. Around saddle corners
    heat is conducted better, so that weights have no spike there, as far as a share of the ``thickness`` of what they
    are on, shape (V,).
    """
    conductivity = corner_conductivity(vertices, faces, thickness)
    return _cotangents(vertices, faces, lambda i, j: conductivity)


def conducting_laplacian(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    thickness: NDArray[np.float64],
    conductivity: NDArray[np.float64],
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """The same where heat is conducted as well as each vertex says, shape (V,): an edge by the mean of its ends."""
    corner = corner_conductivity(vertices, faces, thickness)
    return _cotangents(vertices, faces, lambda i, j: corner * (conductivity[i] + conductivity[j]) / 2.0)


def _cotangents(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], conductivity: Callable[[NDArray, NDArray], NDArray]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    count = len(vertices)
    rows, columns, values = [], [], []
    area = np.zeros(count)
    for k in range(3):
        apex, i, j = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        u, v = vertices[i] - vertices[apex], vertices[j] - vertices[apex]
        twice = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.clip((u * v).sum(axis=1) / np.maximum(twice, 1e-30), 1e-3, 1e3) / 2.0
        rows += [i, j]
        columns += [j, i]
        values += [cotangent * conductivity(i, j)] * 2
        np.add.at(area, apex, twice / 6.0)
    positive = area[area > 0.0]
    # vertices no face uses, and those among faces without area, still belong somewhere
    area = np.maximum(area, 1e-6 * positive.mean()) if positive.size else np.full(count, 1.0 / count)
    return _laplacian(np.concatenate(rows), np.concatenate(columns), np.concatenate(values), count), area


def uniform_laplacian(faces: NDArray[np.int32], count: int) -> sp.csr_array:
    """Every edge conducts alike: what is left where lengths and angles say nothing."""
    rows = np.concatenate([faces[:, k] for k in (0, 1, 2, 1, 2, 0)])
    columns = np.concatenate([faces[:, k] for k in (1, 2, 0, 0, 1, 2)])
    return _laplacian(rows, columns, np.full(len(rows), 0.5), count)


def _laplacian(rows: NDArray, columns: NDArray, conducted: NDArray[np.float64], count: int) -> sp.csr_array:
    between = rows != columns
    off = sp.coo_array((conducted[between], (rows[between], columns[between])), shape=(count, count)).tocsr()
    return sp.diags_array(np.asarray(off.sum(axis=1)).ravel()) - off


def spatial_order(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Vertices along a Z-order curve through space (Morton, 1966), near ones near each other, shape (V,).

    What makes a factorisation quick besides its own ordering by least degrees, which leaves ties to the order given: a
    third of the time of a mesh of 160,000 vertices numbered by reverse Cuthill-McKee.
    """
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cells = ((vertices - low) / (size or 1.0) * (2**_BITS - 1)).astype(np.int64)
    code = np.zeros(len(vertices), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def solve_diffusion(
    matrix: sp.sparray, right: NDArray[np.float64], order: NDArray[np.int64] | None = None
) -> NDArray[np.float64] | None:
    """X of A X = B for a symmetric, diagonally dominant A with a positive diagonal, shape (V, n).

    Scaled to a diagonal of ones, so that tiny and huge triangles count alike. Small systems are factorised; large ones
    are left to multigrid, and where that does not settle to conjugate gradients, both with a bounded number of steps.

    Args:
        matrix: A, shape (V, V).
        right: B, shape (V, n).
        order: Rows near each other near each other, as :func:`spatial_order` gives them, which makes it quick.

    Returns:
        The solution, or None where none was found.
    """
    if order is not None:
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        found = solve_diffusion(sp.csr_array(matrix)[order][:, order], right[order])
        return None if found is None else found[back]
    diagonal = matrix.diagonal()
    if not (np.isfinite(matrix.data).all() and (diagonal > 0.0).all()):
        return None
    scale = 1.0 / np.sqrt(diagonal)
    scaled = (sp.diags_array(scale) @ matrix @ sp.diags_array(scale)).tocsc()
    goal = scale[:, None] * right
    ways = (_direct, _plain) if len(scale) <= _DIRECT_LIMIT else (_multigrid, _plain)
    for way in ways:
        # what a solver has to say of a broken mesh is no message for who gave it: the residual tells
        with warnings.catch_warnings(), np.errstate(all="ignore"), one_blas_thread():
            warnings.simplefilter("ignore")
            try:
                found = way(scaled, goal, scale)
            except (RuntimeError, ArithmeticError, np.linalg.LinAlgError, ValueError):
                continue
            residual = np.linalg.norm(scaled @ found - goal, axis=0)
        if np.isfinite(found).all() and (residual <= _ACCEPTED * np.linalg.norm(goal, axis=0) + 1e-300).all():
            return scale[:, None] * found
    return None


class DiffusionFactor:
    """A symmetric, diagonally dominant matrix, factorised once for many right-hand sides.

    SuperLU factorises; its factors are solved with here, which takes a third of the time for many right-hand sides,
    and several threads.

    Raises:
        ArithmeticError: The diagonal does not dominate.
    """

    def __init__(self, matrix: sp.sparray) -> None:
        scale = 1.0 / np.sqrt(matrix.diagonal())
        scaled = (sp.diags_array(scale) @ matrix @ sp.diags_array(scale)).tocsc()
        with one_blas_thread():
            factors = _factorised(scaled)
        # a dominant diagonal is its own pivot: U = D Lᵀ, and rows are ordered as columns are
        if not np.array_equal(factors.perm_r, factors.perm_c):
            raise ArithmeticError("matrix: its diagonal does not dominate")
        self._place = factors.perm_c.astype(np.int64)  # of each unknown in the factor
        lower, upper = factors.L, factors.U
        lower.sort_indices()
        upper.sort_indices()
        self._first, self._row, self._lower = lower.indptr, lower.indices, lower.data
        self._diagonal = upper.data[upper.indptr[1:] - 1]
        self._scale = np.empty_like(scale)
        self._scale[self._place] = scale

    def solve(
        self, right: NDArray[np.float64], *, weight: NDArray[np.float64] | None = None, times: int = 1
    ) -> NDArray[np.float64]:
        """X of A X = B, shape (V, n); or (A⁻¹ W)^times B with a diagonal matrix W of weights, shape (V,)."""
        import warp as wp
        from warpjld_kernels.symmetric_solve import TOGETHER, solve_symmetric

        count, columns = right.shape
        blocks = -(-columns // TOGETHER)
        values = np.zeros((blocks, count, TOGETHER))
        for column in range(columns):
            values[column // TOGETHER, self._place, column % TOGETHER] = right[:, column]
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
        out = values.transpose(1, 0, 2).reshape(count, -1)[self._place, :columns]
        return np.ascontiguousarray(out)


@contextmanager
def _drawn_alike() -> Iterator[None]:
    """pyamg draws from NumPy's global generator: always the same, and the generator is left as it was."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def _direct(matrix: sp.csc_array, right: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    factors = _factorised(matrix)
    solution: NDArray[np.float64] = factors.solve(right)
    return solution


def _factorised(matrix: sp.csc_array) -> linalg.SuperLU:
    """Of a matrix whose diagonal dominates: no row changes places."""
    return linalg.splu(matrix, diag_pivot_thresh=0.0, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def _multigrid(matrix: sp.csc_array, right: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    import pyamg

    # constants, which diffusion leaves alone, are 1 / scale in the scaled unknowns
    with _drawn_alike():
        hierarchy = pyamg.smoothed_aggregation_solver(sp.csr_matrix(matrix), B=(1.0 / scale)[:, None])
    out = np.empty_like(right)
    for k, b in enumerate(right.T):
        out[:, k], info = hierarchy.solve(b, tol=_TOLERANCE, accel="cg", maxiter=_MULTIGRID_STEPS, return_info=True)
        if info:  # one that does not settle is enough: the next way begins at once
            raise ArithmeticError("multigrid did not settle")
    return out


def _plain(matrix: sp.csc_array, right: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    apply = linalg.LinearOperator(matrix.shape, matvec=matrix.tocsr().dot, dtype=np.float64)
    columns = [linalg.cg(apply, b, rtol=_TOLERANCE, atol=0.0, maxiter=_PLAIN_STEPS)[0] for b in right.T]
    return np.column_stack(columns)
