"""Coarse operators by Galerkin's rule."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpjld.fem.arrays import Mask
from warpjld.fem.launch import grouped, on_rows, shared
from warpjld.fem.solver.block_matrix import BlockMatrix
from warpjld.fem.solver.product import product_pattern

__all__ = ["coarse_matrix", "restriction"]


def coarse_matrix(fine: BlockMatrix, free: Mask, weights: Any, transposed: Any, *, threads: int) -> BlockMatrix:
    """Pᵀ K11 P, float64.

    Args:
        fine: Full matrix K, N blocks a side.
        free: Free degrees of freedom, shape (3N,); the others do not take part.
        weights: P, one weight for the three values of a node, ``csr_array`` (N, n).
        transposed: Pᵀ, see ``restriction``.
        threads: Threads.
    """
    from warpjld_kernels import fem_galerkin

    down, up = (transposed.indptr, transposed.indices), (weights.indptr, weights.indices)
    product = product_pattern(down, (fine.rows, fine.columns), up, weights.shape[1], threads=threads)
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
    """Pᵀ in rows, with the indices that the kernels want."""
    out = weights.T.tocsr()
    out.indices = out.indices.astype(np.int32)
    out.indptr = out.indptr.astype(np.int32)
    return out
