"""Sparse Cholesky factor of a block matrix, for direct solves and as a preconditioner (see ``fem_factor``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warpjld.errors import WarpjldError
from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError
from warpjld.fem.launch import Launch, grouped, on_rows, shared
from warpjld.fem.solver.elimination import Elimination, eliminate

__all__ = ["CostlyError", "Factor"]


class CostlyError(WarpjldError):
    """A factorisation would take more multiplications than allowed."""


class Factor:
    """The factor L of K11 = L Lᵀ.

    Args:
        matrix: Full K, float64.
        free: Mask of free degrees of freedom, shape (3N,).
        threads: Number of threads.
        reuse: A factor that is no longer needed: its memory is overwritten, and its order is kept if it has room for
            all entries of this matrix.
        most: Largest number of multiplications.

    Attributes:
        elimination: The elimination order and its fronts.

    Raises:
        IndefiniteError: K11 is not positive definite.
        CostlyError: It takes more multiplications; known before any is made.
    """

    def __init__(
        self, matrix: BlockMatrix, free: Mask, *, threads: int, reuse: Factor | None = None, most: float = np.inf
    ) -> None:
        self._free = free
        pattern = matrix.rows, matrix.columns
        if reuse is not None and np.array_equal(reuse._free, free):
            self._adopt(reuse.elimination, reuse._pattern, (reuse._panels, reuse._work))
            if self._factorised(matrix, threads):
                self._prepare()
                return
            pattern = _union(pattern, reuse._pattern)
        found = eliminate(*pattern, np.asarray(free.reshape(-1, 3).any(axis=1)))
        if found.work > most:
            raise CostlyError(f"{found.work:.2g} multiplications, more than {most:.2g}")
        self._adopt(found, pattern, (np.empty(found.size + 8), np.empty(found.room + 8)))
        whole = self._factorised(matrix, threads)
        assert whole, "fronts made for a pattern have room for it"
        self._prepare()

    def _adopt(self, elimination: Elimination, pattern: tuple[Ints32, Ints32], memory: tuple[Array, Array]) -> None:
        self.elimination, self._pattern = elimination, pattern
        self._panels, self._work = memory

    def _prepare(self) -> None:
        """Record the launch of the solve."""
        elimination = self.elimination
        self._degrees = (3 * elimination.order[:, None].astype(np.int64) + np.arange(3)).ravel()
        self._x = np.empty(len(self._degrees))
        self._launch = self._solving(np.arange(len(elimination.tables["starts"]) - 1), self._x)

    def _solving(self, fronts: Ints, x: Array) -> Launch:
        """The launch that solves for x in elimination order (n,) with some fronts, ascending."""
        from warpjld_kernels import fem_factor

        tables = self.elimination.tables
        widest = int(np.diff(tables["starts"]).max(initial=0))
        part = fronts.astype(np.int32), np.array([0, len(fronts)], np.int32)
        inputs = [self._fronts(self.elimination, part), shared(self._panels), shared(np.empty(3 * widest + 8))]
        return Launch(fem_factor.solve, 1, [*inputs, shared(x)])

    def solve(self, right: Array) -> Array:
        """Solution of K11 x = b, zero where prescribed, shape (3N,)."""
        self._x[:] = right[self._degrees]
        self._launch()
        out = np.zeros_like(right)
        out[self._degrees] = self._x
        return np.where(self._free, out, 0.0)

    def between(self, rows: Ints, columns: Ints) -> Callable[[Array], Array]:
        """Function of right-hand sides b that vanish outside some degrees of freedom, given at these (r,), to the
        solution at others (c,); equal to that of ``solve`` to the last bit.

        It takes only the fronts that eliminate them, and those above (paths of the elimination tree: Liu 1990, SIAM J.
        Matrix Anal. Appl. 11, 134–172).

        Args:
            rows: Degrees of freedom at which b is given, shape (r,).
            columns: Degrees of freedom at which x is wanted, shape (c,).
        """
        place = 3 * self.elimination.place.astype(np.int64)
        inside = place[rows // 3] >= 0
        at = place[rows // 3][inside] + rows[inside] % 3
        wanted = self._free[columns] & (place[columns // 3] >= 0)
        there = place[columns // 3][wanted] + columns[wanted] % 3
        x = np.zeros(len(self._degrees))
        launch = self._solving(self.elimination.above(np.concatenate([at, there]) // 3), x)

        def solved(right: Array) -> Array:
            x[:] = 0.0
            x[at] = right[inside]
            launch()
            out = np.zeros(len(columns))
            out[wanted] = x[there]
            return out

        return solved

    @staticmethod
    def _fronts(elimination: Elimination, part: tuple[Any, Any]) -> Any:
        from warpjld_kernels import fem_factor

        return grouped(fem_factor.Fronts, **elimination.tables, todo=part[0], parts=part[1])

    def _factorised(self, matrix: BlockMatrix, threads: int) -> bool:
        """Compute the panels; False if the matrix has entries outside the fronts."""
        from warpjld_kernels import fem_factor

        elimination = self.elimination
        blocks = grouped(
            fem_factor.Blocks,
            rows=matrix.rows,
            columns=matrix.columns,
            values=matrix.values.reshape(-1),
            order=elimination.order,
            place=elimination.place,
            free=self._free.astype(np.float64),
        )
        for kernel, memory in ((fem_factor.has_room, ()), (fem_factor.factorise, (self._work, self._panels))):
            for part in (elimination.early, elimination.late):
                count = len(part[1]) - 1
                number = np.full((count, len(elimination.place)), -1, np.int32)
                failed = np.zeros(count, np.int32)
                places = [shared(a) for a in (number.reshape(-1), *memory, failed)]
                on_rows(kernel, count, [self._fronts(elimination, part), blocks, *places], threads=threads, least=2)
                if (failed < 0).any():
                    return False
                if (failed > 0).any():
                    node = int(failed[failed > 0][0]) - 1
                    raise IndefiniteError(f"the stiffness is not positive definite (found at node {node})")
        return True


_ROOM = 1.15
"""Largest ratio of entries in the union of an earlier pattern and the present one to those in the present one, at which
the union is used: pairs that were in contact a moment ago are likely to be in contact again."""


def _union(pattern: tuple[Ints32, Ints32], before: tuple[Ints32, Ints32]) -> tuple[Ints32, Ints32]:
    """Union of two patterns of the same size, or the first one if the union is much larger."""
    count = len(pattern[0]) - 1
    one, other = (
        csr_array((np.ones(len(columns), np.int8), columns, rows), shape=(count, count))
        for rows, columns in (pattern, before)
    )
    sum_ = csr_array(one + other)
    if sum_.nnz > _ROOM * one.nnz:
        return pattern
    sum_.sort_indices()
    return sum_.indptr.astype(np.int32), sum_.indices.astype(np.int32)
