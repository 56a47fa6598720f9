"""Arrays and launches on the processor, as the kernels of touch take them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["floats", "numbers", "recorded", "starts", "vectors"]


def vectors(values: NDArray[np.floating]) -> Any:
    import warp as wp

    return wp.array(np.array(values, dtype=np.float32), dtype=wp.vec3, device="cpu")


def recorded(kernel: Any, dim: int | tuple[int, int], inputs: list[Any], outputs: list[Any]) -> Any:
    """A launch that is prepared once and repeated every frame."""
    import warp as wp

    return wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device="cpu", record_cmd=True)


def numbers(values: NDArray) -> Any:
    import warp as wp

    return wp.array(np.ascontiguousarray(values, dtype=np.int32), dtype=wp.int32, device="cpu")


def floats(values: NDArray) -> Any:
    import warp as wp

    return wp.array(np.ascontiguousarray(values, dtype=np.float32), dtype=float, device="cpu")


def starts(lengths: ArrayLike) -> Any:
    return numbers(np.concatenate([[0], np.cumsum(np.asarray(lengths, dtype=np.int64))]))
