"""Self-penetration test: nodes of a body that lie inside elements of the same body."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.mesh.shape import shape_at, slope_at

__all__ = ["inside_own"]

_ITERATIONS = 8  # Newton steps to natural coordinates; undistorted elements take one
_WITHIN = 1.0 + 1e-6
"""Largest natural coordinate that counts as inside; a node on the face between two elements lies in both."""


def inside_own(x: Array, elements: Ints32, nodes: Ints | Ints32) -> Mask:
    """Mask of the nodes that lie in an element they are not a corner of, shape (n,).

    Args:
        x: Positions of all nodes [m], shape (N, 3).
        elements: Corners of hexahedra, shape (E, 8).
        nodes: Indices of the nodes to test, shape (n,).
    """
    from scipy.spatial import cKDTree

    corners = x[elements]
    centres = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    near = cKDTree(centres).query_ball_point(x[nodes], float(radius.max()))
    counts = np.array([len(found) for found in near])
    which = np.repeat(np.arange(len(nodes)), counts)
    element = np.concatenate([np.asarray(found, dtype=np.int64) for found in near]) if len(which) else which
    at = x[nodes[which]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = 1e-6 * radius[element, None]
    kept = ((at > low[element] - slack) & (at < high[element] + slack)).all(axis=1)
    kept &= (elements[element] != nodes[which, None]).all(axis=1)
    which, element, at = which[kept], element[kept], at[kept]
    place = _natural(corners[element], at)
    out = np.zeros(len(nodes), dtype=bool)
    out[which[np.abs(place).max(axis=1, initial=0.0) < _WITHIN]] = True
    return out


def _natural(corners: Array, at: Array) -> Array:
    """Natural coordinates of points (n, 3) in hexahedra with corners (n, 8, 3), by Newton's method, shape (n, 3)."""
    place = np.zeros_like(at)
    for _ in range(_ITERATIONS):
        shape, slope = shape_at(place), slope_at(place)
        jacobian = np.einsum("nai,nak->nik", corners, slope)
        residual = at - np.einsum("na,nai->ni", shape, corners)
        step = (np.linalg.pinv(jacobian) @ residual[:, :, None])[:, :, 0]  # pinv: elements may have no volume
        place = np.clip(place + step, -3.0, 3.0)
    return place
