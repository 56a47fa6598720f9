"""Work in threads of their own: Warp lets go of the interpreter's lock while a kernel runs on the CPU."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

__all__ = ["cores", "helpers", "in_threads", "one_blas_thread", "threads_for"]


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_for(work: int, least: int) -> int:
    """Threads for a piece of work, each of which has at least ``least`` of it to do."""
    return min(cores(), max(1, work // least))


def in_threads(span: Callable[[int, int], None], count: int, threads: int, kernel: Any, device: Any) -> None:
    """``span(begin, end)`` over 0 … count, cut into as many pieces as there are threads.

    Args:
        span: Launches the kernel over a range; spans must not write to the same memory.
        count: Rows in all; with none, nothing is launched.
        threads: This thread and others.
        kernel: What is launched.
        device: Where.
    """
    import warp as wp

    if not count:
        return
    cuts = np.linspace(0, count, max(1, min(threads, count)) + 1).astype(int).tolist()
    if len(cuts) > 2:
        wp.load_module(kernel.module, device=device)  # compiling is not safe from several threads
    others = [helpers(threads).submit(span, begin, end) for begin, end in pairwise(cuts[1:])]
    span(cuts[0], cuts[1])
    for other in others:
        other.result()


@cache
def helpers(threads: int) -> ThreadPoolExecutor:
    """One thread fewer than that many, kept for the next call: starting threads can cost as much as their work."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="warpjld")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Linear algebra on this thread alone meanwhile, in the whole process; also a decorator.

    A sparse factorisation calls BLAS for thousands of small dense blocks. Threads that wait for their share of each
    spin: on two cores the factorisations of a body of 14,000 vertices take 4 s of the processor instead of 1.4, and
    where other programs want the cores too, 8. Contact solves have vectors and small blocks only: a Krylov step takes
    2.4 ms on one thread, and 340 with busy cores on two; and sums come out in the same order everywhere.
    """
    with _blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _blas() -> Any:
    # NumPy and SciPy each bring a BLAS of their own: both have to be loaded before they can be found
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
