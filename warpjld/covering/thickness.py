"""Thickness of the flesh at every vertex: distance of the skin from its segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import Anchors

__all__ = ["thickness"]


def thickness(anchors: Anchors, joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean distance of every vertex from its projections on its segments [m], weighted by the operators, shape (V,).

    Not the distance from the mean of the projections: in a web this mean lies between two fingers, close to the skin,
    and fields would hardly be diffused there.

    Args:
        anchors: Coordinates of V vertices.
        joints: Rest positions [m], shape (J, 3).
    """
    start, end = (joints[anchors.ends[anchors.segment, k]] for k in (0, 1))
    foot = start + anchors.ratio[..., None] * (end - start)
    distance = np.linalg.norm(anchors.rest[:, None] - foot, axis=2)
    return np.asarray((anchors.weight * distance).sum(axis=1))
