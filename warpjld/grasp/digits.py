"""The digits of a skeleton: their joints, and the middles of their pads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.covering import Covering
from warpjld.covering.segment_table import SegmentTable
from warpjld.errors import InputError
from warpjld.skeleton import Skeleton
from warpjld.skeleton.digits import digit_joints

__all__ = ["digit_chains", "pad_vertex"]

_KNUCKLES = 3  # joints of a digit that can close round an object


def digit_chains(skeleton: Skeleton, digits: Sequence[str] = ()) -> dict[str, tuple[int, ...]]:
    """Flexion joints of the digits of a skeleton, base first; of all, or of those named (``index``, ``left.index``).

    Raises:
        InputError: There is no such digit, or none at all.
    """
    found = {name: joints for name, joints in digit_joints(skeleton).items() if len(joints) == _KNUCKLES}
    if not found:
        raise InputError("this skeleton has no digits to close")
    if not digits:
        return found
    chosen = {}
    for digit in digits:
        matches = [name for name in found if digit.lower() in (name, name.partition(".")[2])]
        if len(matches) != 1:
            raise InputError(f"no digit '{digit}' in this skeleton; there are {', '.join(found)}")
        chosen[matches[0]] = found[matches[0]]
    return chosen


def pad_vertex(covering: Covering, digit: str) -> int:
    """The vertex in the middle of a digit's pad: on the internal side of its last segment, three fifths along.

    Raises:
        InputError: There is no such digit.
    """
    (chain,) = digit_chains(covering.skeleton, [digit]).values()
    anchors = covering.anchors
    strongest = anchors.weight.argmax(axis=1)
    rows = np.arange(len(anchors))
    on_last = anchors.ends[anchors.segment[rows, strongest], 0] == chain[-1]
    ratio, side = anchors.ratio[rows, strongest], anchors.side[rows, strongest]
    # of vertices alike in ratio the one farthest out on the internal side
    table = SegmentTable.build(covering.skeleton, anchors.ends)
    height = np.linalg.norm(table.heights(anchors.rest, anchors.segment[rows, strongest]), axis=1)
    length = np.linalg.norm(np.ptp(covering.surface.vertices[on_last], axis=0))
    cost = np.where(on_last, np.abs(ratio - 0.6) + side - height / length, np.inf)
    return int(cost.argmin())
