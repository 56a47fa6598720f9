"""Which skin moves when joints bend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.skeleton import Skeleton

__all__ = ["joints_beyond", "share_moved", "skin_beyond", "skin_that_moves"]

_OWN = 0.5  # share of the operators at or beyond a joint from which a vertex counts as beyond it


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


def skin_beyond(covering: Covering, joint: int) -> NDArray[np.int32]:
    """Vertices of which operators at or beyond a joint hold at least half."""
    return np.flatnonzero(share_moved(covering, joint) >= _OWN).astype(np.int32)


def skin_that_moves(covering: Covering, joints: Sequence[int]) -> NDArray[np.int32]:
    """Vertices that move at all when joints bend, those of the palm that swell included."""
    anchors = covering.anchors
    beyond = np.any([joints_beyond(covering.skeleton, joint) for joint in joints], axis=0)
    touched = beyond[anchors.ends[anchors.segment]].any(axis=2)
    return np.flatnonzero(((anchors.weight > 0.0) & touched).any(axis=1)).astype(np.int32)
