"""Vertices that move when joints flex."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.binding import STATIONS
from warpjld.skeleton import Skeleton

__all__ = ["joints_beyond", "share_moved", "skin_beyond", "skin_that_moves"]

_OWN = 0.5  # weight of the operators at or beyond a joint from which a vertex counts as beyond it


def joints_beyond(skeleton: Skeleton, joint: int) -> NDArray[np.bool_]:
    """Mask of a joint and its descendants, shape (J,)."""
    out = np.zeros(len(skeleton), dtype=bool)
    for j, parent in enumerate(skeleton.parents):
        out[j] = j == joint or (parent >= 0 and out[parent])
    return out


def share_moved(covering: Covering, joint: int) -> NDArray[np.float64]:
    """Weight of the operators at or beyond a joint on every vertex, from 0 to 1, shape (V,)."""
    anchors = covering.anchors
    beyond = joints_beyond(covering.skeleton, joint)
    return np.asarray((anchors.weight * beyond[anchors.ends[anchors.segment, 0]]).sum(axis=1))


def skin_beyond(covering: Covering, joint: int) -> NDArray[np.int32]:
    """Indices of the vertices on which the operators at or beyond a joint have at least half of the weight."""
    return np.flatnonzero(share_moved(covering, joint) >= _OWN).astype(np.int32)


def skin_that_moves(covering: Covering, joints: Sequence[int]) -> NDArray[np.int32]:
    """Indices of all vertices that move when joints flex, including those of the palm that swell."""
    rows = covering.rows
    beyond = np.any([joints_beyond(covering.skeleton, joint) for joint in joints], axis=0)
    parents = np.maximum(covering.skeleton.parents, 0)
    # the halfway rotation at a joint depends on the bone before it and the bone after it
    inputs = np.concatenate([beyond, beyond | beyond[parents], beyond])
    ends = beyond[covering.anchors.ends]
    pairs = ends[covering.anchors.pairs].any(axis=(1, 2)) if len(covering.anchors.pairs) else np.zeros(0, dtype=bool)
    scales = np.concatenate([beyond, np.repeat(pairs, STATIONS)])
    read = sp.hstack([rows.positions, rows.turns, rows.scales, rows.muscles], format="csr")
    moves = np.concatenate([inputs, scales, ends.any(axis=1)])
    return np.flatnonzero((abs(read) @ moves.astype(np.float64)) > 0.0).astype(np.int32)
