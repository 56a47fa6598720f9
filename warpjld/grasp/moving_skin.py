"""Which skin moves when joints bend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.binding import STATIONS
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
    rows = covering.rows
    beyond = np.any([joints_beyond(covering.skeleton, joint) for joint in joints], axis=0)
    parents = np.maximum(covering.skeleton.parents, 0)
    # a halfway rotation turns with its joint's own bone and with the one before
    inputs = np.concatenate([beyond, beyond | beyond[parents], beyond])
    ends = beyond[covering.anchors.ends]
    pairs = ends[covering.anchors.pairs].any(axis=(1, 2)) if len(covering.anchors.pairs) else np.zeros(0, dtype=bool)
    scales = np.concatenate([beyond, np.repeat(pairs, STATIONS)])
    read = sp.hstack([rows.positions, rows.turns, rows.scales, rows.muscles], format="csr")
    moves = np.concatenate([inputs, scales, ends.any(axis=1)])
    return np.flatnonzero((abs(read) @ moves.astype(np.float64)) > 0.0).astype(np.int32)
