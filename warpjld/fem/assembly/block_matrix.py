"""Sparse matrices of 3×3 blocks, three degrees of freedom per node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array

from warpjld.errors import WarpjldError
from warpjld.fem.arrays import Ints, Ints32, Mask
from warpjld.fem.launch import on_rows, shared, threads_of

__all__ = ["BlockMatrix", "IndefiniteError", "padded"]


class IndefiniteError(WarpjldError):
    """A matrix that should be positive definite is not."""


def padded(count: int, dtype: Any = np.float64) -> NDArray[Any]:
    """A zero vector of ``count`` values with spare memory behind it: kernels load three values as four."""
    return np.zeros(count + 8, dtype=dtype)[:count]


@dataclass(frozen=True, eq=False)
class BlockMatrix:
    """N × N blocks in compressed row storage (BSR); symmetric, both triangles are stored.

    Attributes:
        rows: Start of each block row, shape (N + 1,).
        columns: Column of each block, ascending in a row, shape (B,).
        values: Blocks, shape (B, 3, 3).
    """

    rows: Ints32
    columns: Ints32
    values: NDArray[Any]

    @property
    def size(self) -> int:
        """Number of block rows, N."""
        return len(self.rows) - 1

    @property
    def arguments(self) -> list[Any]:
        """Kernel arguments: rows, columns, values."""
        return [shared(self.rows), shared(self.columns), shared(self.values.reshape(-1))]

    def product(self, x: NDArray[Any], out: NDArray[Any] | None = None, *, threads: int | None = None) -> NDArray[Any]:
        """Product A x, shape (3N,)."""
        from warpjld_kernels import fem_blocks

        source = padded(3 * self.size, self.values.dtype)
        source[:] = x.reshape(-1)
        result = np.empty(3 * self.size, self.values.dtype) if out is None else out
        on_rows(
            fem_blocks.product,
            self.size,
            [*self.arguments, shared(source), shared(result)],
            threads=threads_of(threads),
        )
        return result

    @property
    def on_diagonal(self) -> Ints:
        """Index of each row's diagonal block, shape (N,)."""
        row = np.repeat(np.arange(self.size, dtype=np.int32), np.diff(self.rows))
        return np.flatnonzero(row == self.columns)

    def diagonal(self) -> NDArray[Any]:
        """Diagonal blocks, shape (N, 3, 3)."""
        return np.asarray(self.values[self.on_diagonal])

    def with_diagonal(self, added: NDArray[Any]) -> BlockMatrix:
        """A copy with a value per node, shape (N,), added to the diagonal."""
        values = self.values.copy()
        values[self.on_diagonal] += added[:, None, None] * np.eye(3)
        return BlockMatrix(self.rows, self.columns, values)

    def masked(self, free: Mask, dtype: Any = np.float64) -> BlockMatrix:
        """K11 at full size: rows and columns of prescribed degrees of freedom are set to zero (R107).

        Args:
            free: Mask of free degrees of freedom, shape (3N,).
            dtype: Type of the result's values.
        """
        values = self.values.astype(dtype)
        kept = free.reshape(-1, 3)
        touched: Mask = np.asarray(~kept.all(axis=1))
        if touched.any():
            row = np.repeat(np.arange(self.size, dtype=np.int32), np.diff(self.rows))
            block = np.flatnonzero(touched[row])
            values[block] *= kept[row[block]][:, :, None]
            block = np.flatnonzero(touched[self.columns])
            values[block] *= kept[self.columns[block]][:, None, :]
        return BlockMatrix(self.rows, self.columns, values)

    def to_scipy(self) -> Any:
        """The same matrix as ``scipy.sparse.bsr_array``."""
        n = 3 * self.size
        return bsr_array((self.values, self.columns, self.rows), shape=(n, n))
