"""Bracketing, which all searches for angles of a grip share: outwards in growing steps, then inside along a line."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warpjld.errors import InputError

__all__ = ["checked_step", "clipped_inside", "outward"]


def checked_step(low: float, high: float, start: float | None) -> float:
    """The first step above ``low``: as given, or a sixteenth of the range.

    Raises:
        InputError: A range that is none, or a step out of it.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise InputError(f"grip: want low < high, got {low} and {high}")
    step = (high - low) / 16.0 if start is None else float(start)
    if not 0.0 < step <= high - low:
        raise InputError(f"grip: want a first step above 0 within the range, got {step}")
    return step


def outward(low: float, high: float, step: float, growth: float, *, from_low: bool) -> Iterator[float]:
    """Places from ``low`` to ``high``, farther and farther apart.

    Args:
        low: The first.
        high: The last.
        step: First step.
        growth: How much longer the next is.
        from_low: Whether steps are taken from ``low``, not from the place before.
    """
    at = low
    yield at
    while at < high:
        at = min(high, (low if from_low else at) + step)
        step *= growth
        yield at


def clipped_inside(at: float, below: float, above: float, margin: float) -> float:
    """A place in a bracket, no nearer to its ends than a share of it."""
    room = margin * (above - below)
    return float(np.clip(at, below + room, above - room))
