"""Conductivity around saddle vertices of a triangulated surface, graded so that diffused weights keep finite slopes.

Round a vertex whose angles sum to θ > 2π, as they do in the webs of a coarse hand, a harmonic function goes as
r^(2π/θ): the finer the mesh, the steeper the weights, and so the larger the stretch, without bound. With a conductivity
of r^((2π/θ)² − 1) it goes as r, and the slope stays finite: ν = 1 solves ν (ν + β) = (2π/θ)² for β = (2π/θ)² − 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.within_balls import within_balls

__all__ = ["corner_conductivity"]

_REACH = 0.4
"""Radius within which the conductivity is raised, relative to the thickness of the flesh at the vertex.

Relative to the size of the whole surface, the radius at a hand's webs covered all its fingers where the hand was part
of a body. With .5 and more the largest stretch of the coarsest hand grows by a tenth at its first refinement."""

_MARGIN = 1.3  # factor of the theoretical exponent, since cotangents of obtuse triangles are clipped
_SHARP = 1.03  # θ / 2π above which a vertex counts as a saddle; below, slopes grow by less at each halving of the edges
_MOST = 4_000  # saddles considered, largest angle sums first: a surface with more of them is noise
_MOST_PAIRS = 4_000_000  # limit of triangles near all of them, which bounds memory where vertices coincide
_BEST = np.log(1e4)  # upper bound of the conductivity's logarithm, where adjacent saddles add up


def corner_conductivity(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], thickness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Conductivity of every triangle, 1 away from saddle corners, shape (T,).

    Args:
        vertices: Vertex positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        thickness: Distance of the skin from its bone at every vertex [m], shape (V,).
    """
    turns = _angle_sums(vertices, faces) / (2.0 * np.pi)
    corners = np.argsort(-turns)[:_MOST]
    corners = corners[turns[corners] > _SHARP]
    exponent = np.zeros(len(faces))
    if not corners.size:
        return np.exp(exponent)
    centroids = vertices[faces].mean(axis=1)
    reach = _REACH * np.asarray(thickness, dtype=np.float64)
    ball, near = within_balls(centroids, vertices[corners], reach[corners], _MOST_PAIRS)
    of = corners[ball]
    distance = np.linalg.norm(centroids[near] - vertices[of], axis=1) / reach[of]
    beta = _MARGIN * (turns[of] ** -2.0 - 1.0)
    np.add.at(exponent, near, beta * np.log(np.clip(distance, 1e-6, 1.0)))
    return np.exp(np.minimum(exponent, _BEST))


def _angle_sums(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Sum of the triangle angles at every vertex [rad], shape (V,)."""
    total = np.zeros(len(vertices))
    for k in range(3):
        apex, i, j = (vertices[faces[:, (k + n) % 3]] for n in range(3))
        u, v = i - apex, j - apex
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        np.add.at(total, faces[:, k], angle)
    return total
