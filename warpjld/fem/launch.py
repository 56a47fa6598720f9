"""Launches of CPU kernels over rows, distributed over threads."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.runtime.threads import cores, helpers

__all__ = ["Launch", "grouped", "on_rows", "shared", "threads_of"]

_LEAST_ROWS = 3000
"""Number of rows below which distribution over threads costs more than it saves."""


def threads_of(threads: int | None = None) -> int:
    """The given number of threads; by default as many as this process may use."""
    return cores() if threads is None else max(1, threads)


def shared(values: NDArray[Any]) -> Any:
    """A Warp array that shares the memory of a contiguous NumPy array.

    Raises:
        ValueError: The array is not contiguous.
    """
    import warp as wp

    wp.init()
    if not values.flags.c_contiguous:
        raise ValueError("want a contiguous array")
    return wp.from_numpy(values, device="cpu") if values.size == 0 else wp.array(values, device="cpu", copy=False)


def grouped(kind: Any, **arrays: NDArray[Any]) -> Any:
    """A Warp struct whose arrays share the memory of NumPy arrays; non-contiguous ones are copied first."""
    group = kind()
    for name, values in arrays.items():
        setattr(group, name, shared(np.ascontiguousarray(values)))
    return group


class Launch:
    """A kernel over rows with its arguments, recorded once to be run many times.

    Args:
        kernel: Kernel with its first row as first argument.
        count: Number of rows.
        inputs: Further arguments; arrays are kept alive.
        threads: Threads to distribute the rows over; results of rows must not depend on it.
        least: Number of rows below which a single thread is used.
    """

    def __init__(
        self, kernel: Any, count: int, inputs: list[Any], *, threads: int = 1, least: int = _LEAST_ROWS
    ) -> None:
        import warp as wp

        parts = threads if threads > 1 and count >= max(least, 2) else 1
        edges = np.linspace(0, count, parts + 1).astype(int)
        self._kept = inputs
        self._threads = threads
        self._commands = [
            wp.launch(kernel, dim=int(high - low), inputs=[int(low), *inputs], device="cpu", record_cmd=True)
            for low, high in pairwise(edges)
            if high > low
        ]

    def __call__(self) -> None:
        """Run the kernel; returns when all rows are done."""
        others = [helpers(self._threads).submit(command.launch) for command in self._commands[1:]]
        for command in self._commands[:1]:
            command.launch()
        for other in others:
            other.result()


def on_rows(kernel: Any, count: int, inputs: list[Any], *, threads: int = 1, least: int = _LEAST_ROWS) -> None:
    """Launch ``kernel(first, *inputs)`` over ``count`` rows once (see ``Launch``)."""
    Launch(kernel, count, inputs, threads=threads, least=least)()
