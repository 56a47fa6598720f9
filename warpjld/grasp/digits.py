"""Digits of a skeleton: chains of flexion joints, and the vertex in the middle of each pad."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.covering import Covering
from warpjld.covering.segment_table import SegmentTable
from warpjld.errors import InputError
from warpjld.skeleton import Skeleton
from warpjld.skeleton.digits import digit_joints

__all__ = ["digit_chains", "pad_vertex"]

_KNUCKLES = 3  # flexion joints that a digit must have to be closed


def digit_chains(skeleton: Skeleton, digits: Sequence[str] = ()) -> dict[str, tuple[int, ...]]:
    """Flexion joints of digits by name, base first; of all digits, or of those named (``index``, ``left.index``).

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
    """Vertex in the middle of a digit's pad: on the palmar side of its last segment, at 60 % of its length.

    Raises:
        InputError: There is no such digit, or no skin on its last segment.
    """
    (chain,) = digit_chains(covering.skeleton, [digit]).values()
    anchors = covering.anchors
    strongest = anchors.weight.argmax(axis=1)
    rows = np.arange(len(anchors))
    on_last = anchors.ends[anchors.segment[rows, strongest], 0] == chain[-1]
    if not on_last.any():
        raise InputError(
            f"no skin belongs to the last segment of '{digit}': it cannot touch anything; see `warpjld inspect`"
        )
    ratio, side = anchors.ratio[rows, strongest], anchors.side[rows, strongest]
    # of vertices with similar ratio, the one farthest from the bone on the palmar side
    table = SegmentTable.build(covering.skeleton, anchors.ends)
    height = np.linalg.norm(table.heights(anchors.rest, anchors.segment[rows, strongest]), axis=1)
    length = np.linalg.norm(np.ptp(covering.surface.vertices[on_last], axis=0))
    cost = np.where(on_last, np.abs(ratio - 0.6) + side - height / length, np.inf)
    return int(cost.argmin())
