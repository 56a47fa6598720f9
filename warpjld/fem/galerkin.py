"""Coarse operators by Galerkin's rule."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.blockmatrix import BlockMatrix
from warpjld.fem.rows import grouped, on_rows, shared

__all__ = ["coarse_matrix", "restriction"]


def coarse_matrix(
    fine: BlockMatrix, free: NDArray[np.bool_], weights: Any, transposed: Any, *, threads: int
) -> BlockMatrix:
    """Pᵀ K11 P, float64.

    Args:
        fine: Full matrix K, N blocks a side.
        free: Free degrees of freedom, shape (3N,); the others do not take part.
        weights: P, one weight for the three values of a node, ``csr_array`` (N, n).
        transposed: Pᵀ, see ``restriction``.
        threads: Threads.
    """
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


def restriction(weights: Any) -> Any:
    """Pᵀ in rows, with the indices that the kernels want."""
    out = weights.T.tocsr()
    out.indices = out.indices.astype(np.int32)
    out.indptr = out.indptr.astype(np.int32)
    return out
