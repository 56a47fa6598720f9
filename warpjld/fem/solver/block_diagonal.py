"""The diagonal blocks of a stiffness, inverted: what smoothers and Jacobi's preconditioner take."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.solver.block_matrix import BlockMatrix, IndefiniteError

__all__ = ["block_inverse"]


def block_inverse(matrix: BlockMatrix, free: Mask | None = None) -> Array:
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
    inverse: Array = np.linalg.inv(blocks)
    return inverse * (on[:, :, None] & on[:, None, :])
