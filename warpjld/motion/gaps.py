"""Frames in which a tracker lost a hand: they are interpolated, and said."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["bridged"]


def bridged(what: str, frames: Sequence[int]) -> tuple[str, ...]:
    """A note of the frames missing between the first and the last given one; none where none is.

    Args:
        what: What is missing there.
        frames: Numbers of the frames that there are, increasing.
    """
    steps = np.diff(np.asarray(frames, dtype=np.int64))
    lost = int((steps - 1).sum()) if len(steps) else 0
    if lost == 0:
        return ()
    longest = int(steps.argmax())
    return (
        f"{what} was lost in {lost} frames, at most {steps[longest] - 1} in a row after frame {frames[longest]}: "
        "interpolated",
    )
