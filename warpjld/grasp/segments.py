"""The sixteen parts of a hand that touch things: the digits' segments, and the palm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.skeleton import DIGITS
from warpjld.skeleton.hand import FINGER_JOINTS

__all__ = ["SEGMENTS", "vertex_segments"]

SEGMENTS = (*(f"{digit}.{joint}" for digit in reversed(DIGITS) for joint in FINGER_JOINTS[:3]), "palm")
"""Each named after the joint it begins at; thumb first, the palm with its carpus last."""


def vertex_segments(covering: Covering, side: str = "") -> NDArray[np.int64]:
    """Place in ``SEGMENTS`` of every vertex, shape (V,); -1 for what is no hand, or not the hand of that side."""
    segment = np.array([_segment(fan.name, side) for fan in covering.fans])
    return np.asarray(segment[covering.domains.argmax(axis=1)])


def _segment(fan: str, side: str) -> int:
    """Place in ``SEGMENTS`` of what an operator of the covering moves."""
    if side and not fan.startswith(f"{side}."):
        return -1
    name = fan.removeprefix("left.").removeprefix("right.")
    if name in SEGMENTS:
        return SEGMENTS.index(name)
    return SEGMENTS.index("palm") if name in ("carpus", "wrist") or name.endswith(".carpometacarpal") else -1
