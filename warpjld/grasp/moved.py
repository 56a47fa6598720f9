"""Which skin moves when a digit bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.skeleton import Skeleton

__all__ = ["joints_beyond", "share_moved"]


def joints_beyond(skeleton: Skeleton, joint: int) -> NDArray[np.bool_]:
    """Joints at or beyond a joint, shape (J,)."""
    out = np.zeros(len(skeleton), dtype=bool)
    for j, parent in enumerate(skeleton.parents):
        out[j] = j == joint or (parent >= 0 and out[parent])
    return out


def share_moved(covering: Covering, joint: int) -> NDArray[np.float64]:
    """Share of every vertex that operators at or beyond a joint hold, shape (V,)."""
    anchors = covering.anchors
    beyond = joints_beyond(covering.skeleton, joint)
    return np.asarray((anchors.weight * beyond[anchors.ends[anchors.segment, 0]]).sum(axis=1))
