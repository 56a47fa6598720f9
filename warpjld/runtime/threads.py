"""Multithreaded execution: Warp releases the global interpreter lock while a kernel runs on the CPU."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

__all__ = ["cores", "each_in_threads", "helpers", "in_threads", "one_blas_thread", "threads_for"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_for(work: int, least: int) -> int:
    """Number of threads such that each has at least ``least`` of the work, at most one per core."""
    return min(cores(), max(1, work // least))


def in_threads(span: Callable[[int, int], None], count: int, threads: int, kernel: Any, device: Any) -> None:
    """Run ``span(begin, end)`` over 0 … count, divided into one range per thread.

    Args:
        span: Launches the kernel over a range; ranges must not write to the same memory.
        count: Number of rows; if 0, nothing is launched.
        threads: Number of threads, including the calling one.
        kernel: The kernel that is launched.
        device: Its device.
    """
    import warp as wp

    if not count:
        return
    import numpy as np  # not above: who only asks for the number of cores need not have it

    cuts = np.linspace(0, count, max(1, min(threads, count)) + 1).astype(int).tolist()
    if len(cuts) > 2:
        wp.load_module(kernel.module, device=device)  # compilation is not thread-safe
    others = [helpers(threads).submit(span, begin, end) for begin, end in pairwise(cuts[1:])]
    span(cuts[0], cuts[1])
    for other in others:
        other.result()


def each_in_threads(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """``function(item)`` of every item, in their order, at once on all cores.

    For long functions that release the interpreter lock, as SuperLU's factorisation does. What the first of them to
    fail raises is raised.
    """
    threads = min(cores(), len(items))
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads, thread_name_prefix="warpjld") as pool:
        return list(pool.map(function, items))


@cache
def helpers(threads: int) -> ThreadPoolExecutor:
    """A pool of ``threads`` - 1 threads, reused by later calls: starting threads can cost as much as their work."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="warpjld")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Restrict BLAS to one thread, in the whole process; context manager and decorator.

    A sparse factorisation calls BLAS for thousands of small dense blocks, in which waiting threads spin: on two cores
    the factorisations of a body of 14,000 vertices take 4 s of processor time instead of 1.4 s, or 8 s if other
    programs use the cores. Contact solves have vectors and small blocks only: a Krylov step takes 2.4 ms on one thread,
    and 340 ms on two busy cores. One thread also makes the order of summation reproducible.
    """
    with _blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _blas() -> Any:
    # NumPy and SciPy each have their own BLAS: both must be loaded before threadpoolctl can find them
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
