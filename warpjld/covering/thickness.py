"""Thickness of the flesh at every vertex: distance of the skin from its segments, and the mean of it around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import Anchors
from warpjld.covering.heat import diffused

__all__ = ["mean_thickness", "thickness"]

_REACH = 1.2
"""Diffusion length of the mean, per thickness: half around a limb, so that opposite sides share their values."""


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


def mean_thickness(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], own: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Thickness averaged over the surface around every vertex [m], shape (V,).

    A bone that runs close to one side of a limb, as at the top of a shoulder, is near the skin there, but that skin
    slides over flesh as thick as on the other side.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        own: Distance of the skin from its segments [m], shape (V,).
    """
    return diffused(own, vertices, faces, (_REACH * own) ** 2) if len(faces) else own
