"""Smoothed aggregation with rigid-body modes (pyamg), for meshes without structure."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.solver.block_matrix import BlockMatrix

__all__ = ["Aggregation"]


class Aggregation:
    """One V-cycle of smoothed aggregation.

    Args:
        stiffness: Full K, float64.
        free: Free degrees of freedom, shape (3N,).
        nodes: Rest positions [m], shape (N, 3): what the rigid-body modes are made of.
    """

    def __init__(self, stiffness: BlockMatrix, free: Mask, nodes: Array) -> None:
        import pyamg

        from warpjld.fem.load.prescribed import rigid_modes

        matrix = stiffness.masked(free)
        diagonal = np.einsum("nii->ni", matrix.diagonal())
        on = matrix.on_diagonal
        # prescribed degrees of freedom stay in the blocks, uncoupled
        matrix.values[on[:, None], [0, 1, 2], [0, 1, 2]] += ~free.reshape(-1, 3) * diagonal.max()
        modes = rigid_modes(nodes) * free[:, None]
        from scipy.sparse import bsr_matrix

        n = 3 * matrix.size
        self._free = free
        self._levels = pyamg.smoothed_aggregation_solver(
            bsr_matrix((matrix.values, matrix.columns, matrix.rows), shape=(n, n)), B=modes, max_coarse=500
        )
        self._apply = self._levels.aspreconditioner(cycle="V")

    def __call__(self, r: NDArray[Any]) -> NDArray[Any]:
        """z = M r, shape (3N,)."""
        result: NDArray[Any] = (self._apply @ r.astype(np.float64)) * self._free
        return result.astype(r.dtype)
