"""The sixteen contact regions of a hand: three segments of each digit, and the palm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.skeleton import DIGITS
from warpjld.skeleton.hand import FINGER_JOINTS

__all__ = ["SEGMENTS", "vertex_segments"]

SEGMENTS = (*(f"{digit}.{joint}" for digit in reversed(DIGITS) for joint in FINGER_JOINTS[:3]), "palm")
"""Their names: each segment has that of the joint it begins at, thumb first; the palm, with the carpus, is last."""


def vertex_segments(covering: Covering, side: str = "") -> NDArray[np.int64]:
    """Index into ``SEGMENTS`` of every vertex, shape (V,); -1 for vertices of no hand, or not of that side's hand."""
    segment = np.array([_segment(fan.name, side) for fan in covering.fans])
    return np.asarray(segment[covering.domains.argmax(axis=1)])


def _segment(fan: str, side: str) -> int:
    """Index into ``SEGMENTS`` of the vertices of an operator, by its name."""
    if side and not fan.startswith(f"{side}."):
        return -1
    name = fan.removeprefix("left.").removeprefix("right.")
    if name in SEGMENTS:
        return SEGMENTS.index(name)
    return SEGMENTS.index("palm") if name in ("carpus", "wrist") or name.endswith(".carpometacarpal") else -1
