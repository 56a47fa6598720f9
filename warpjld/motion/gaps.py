"""Notes on frames in which a tracker lost a hand; these frames are interpolated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["bridged"]


def bridged(what: str, frames: Sequence[int]) -> tuple[str, ...]:
    """A note about frames missing between the first and the last given one; empty if none is missing.

    Args:
        what: What was not tracked, for the note.
        frames: Numbers of the frames with data, increasing.
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
