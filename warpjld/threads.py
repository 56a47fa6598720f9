"""Work in threads of their own: Warp lets go of the interpreter's lock while a kernel runs on the CPU."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

__all__ = ["cores", "helpers", "in_threads", "threads_for"]


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
