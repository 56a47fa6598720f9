"""Warnings of computations as texts, for programs that report them as notes instead of printing them raw."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["warning_texts"]


@contextmanager
def warning_texts(*categories: type[Warning]) -> Iterator[Callable[[], list[str]]]:
    """Collect warnings of these categories; all others are issued again at the end.

    Yields:
        A function that returns the texts since its last call. Of texts that differ only in numbers the first is
        returned, as iterative computations repeat a warning at every step.
    """
    seen: set[str] = set()
    with warnings.catch_warnings(record=True) as caught:
        for category in categories:
            warnings.simplefilter("always", category)
        read = 0

        def texts() -> list[str]:
            nonlocal read
            fresh, read = caught[read:], len(caught)
            out = []
            for one in fresh:
                kind = re.sub(r"[\d.]+", "", str(one.message))
                if issubclass(one.category, categories) and kind not in seen:
                    seen.add(kind)
                    out.append(str(one.message))
            return out

        yield texts
    for one in caught:
        if not issubclass(one.category, categories):
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
