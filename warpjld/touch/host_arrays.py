"""Warp arrays and recorded kernel launches on the CPU."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["floats", "numbers", "recorded", "starts", "vectors"]


class _Nothing:
    """A recorded launch that does nothing."""

    def launch(self) -> None:
        """Do nothing."""


_NOTHING = _Nothing()


def vectors(values: NDArray[np.floating]) -> Any:
    """A Warp array of vec3 (n,) that owns a copy of values (n, 3)."""
    import warp as wp

    return wp.array(np.array(values, dtype=np.float32), dtype=wp.vec3, device="cpu")


def recorded(kernel: Any, dim: int | tuple[int, int], inputs: list[Any], outputs: list[Any]) -> Any:
    """A kernel launch with fixed arguments, recorded once to be repeated every frame; of no rows, it does nothing."""
    import warp as wp

    # Warp records nothing of a launch without rows
    return wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device="cpu", record_cmd=True) or _NOTHING


def numbers(values: NDArray) -> Any:
    """A Warp array of int32."""
    import warp as wp

    return wp.array(np.ascontiguousarray(values, dtype=np.int32), dtype=wp.int32, device="cpu")


def floats(values: NDArray) -> Any:
    """A Warp array of float32."""
    import warp as wp

    return wp.array(np.ascontiguousarray(values, dtype=np.float32), dtype=float, device="cpu")


def starts(lengths: ArrayLike) -> Any:
    """Row pointers of a CSR layout, shape (n + 1,), from the rows' lengths (n,)."""
    return numbers(np.concatenate([[0], np.cumsum(np.asarray(lengths, dtype=np.int64))]))
