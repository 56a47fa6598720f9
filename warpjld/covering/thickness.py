"""How thick a limb is at every vertex: how far the skin lies from its bones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import Anchors

__all__ = ["thickness"]


def thickness(anchors: Anchors, joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean distance of every vertex from its place on each of its segments [m], by the operators' weights, shape (V,).

    Not the distance from the mean of those places: in a web that lies between two fingers, where the skin is too, and
    fields would stay as steep there as they are.

    Args:
        anchors: Places of V vertices.
        joints: Rest positions [m], shape (J, 3).
    """
    start, end = (joints[anchors.ends[anchors.segment, k]] for k in (0, 1))
    foot = start + anchors.ratio[..., None] * (end - start)
    distance = np.linalg.norm(anchors.rest[:, None] - foot, axis=2)
    return np.asarray((anchors.weight * distance).sum(axis=1))
