"""Embedding of a surface in a volume mesh, so that it deforms with it and keeps its own topology (R104)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.mesh.shape import CENTRE_GRADIENT, shape_at, slope_at

__all__ = ["Embedding", "embed", "embed_between"]

_NEAR = 12
"""Candidate elements for each point, by distance of their centres."""
_STILL = 1e-12
"""Change of reference coordinates after which the next, as Newton's method converges, is rounding."""


@dataclass(frozen=True, eq=False)
class Embedding:
    """Points interpolated from the nodes of the element they lie in, or nearest to.

    Attributes:
        corners: Nodes of the elements, shape (P, 8).
        weights: Shape functions at the points, rows summing to one, shape (P, 8).
        outside: Distance of each point from its element, 0 inside, in element sizes, shape (P,): half of its reference
            coordinates' excess up to 1, lengths over the size of an ordinary element beyond.
    """

    corners: Ints32
    weights: Array
    outside: Array

    def carry(self, displacement: Array) -> Array:
        """Displacement of the points [m], shape (P, 3), from that of the nodes, shape (N, 3)."""
        out: Array = np.einsum("pa,pai->pi", self.weights, displacement[self.corners])
        return out


def embed(mesh: HexMesh, points: Array, *, reach: float = 1.0) -> Embedding:
    """Find the element of every point and its coordinates there; points beyond the boundary are extrapolated.

    Args:
        mesh: The volume mesh at rest.
        points: [m], shape (P, 3).
        reach: Largest distance of a point from its element, in element sizes.

    Raises:
        InputError: A point further from the mesh than ``reach``.
    """
    x = mesh.nodes[mesh.elements]
    _, near = cKDTree(x.mean(axis=1)).query(points, k=min(_NEAR, len(x)))
    near = near.reshape(len(points), -1)
    best = np.full(len(points), np.inf)
    place = np.zeros((len(points), 3))
    owner = np.zeros(len(points), np.int64)
    for column in range(near.shape[1]):
        todo = np.flatnonzero(best > 1e-6)
        if len(todo) == 0:
            break
        at = _local(x[near[todo, column]], points[todo])
        beyond = 0.5 * np.maximum(np.abs(at).max(axis=1) - 1.0, 0.0)
        better = beyond < best[todo]
        chosen = todo[better]
        best[chosen], place[chosen], owner[chosen] = beyond[better], at[better], near[chosen, column]
    lost = np.flatnonzero(best > 1.0)
    if len(lost):
        best[lost], place[lost], chosen = _nearest(x, near[lost], points[lost])
        owner[lost] = np.take_along_axis(near[lost], chosen[:, None], axis=1)[:, 0]
    if not (best <= reach).all():
        worst = int(np.argmax(best))
        raise InputError(f"point {worst} lies {best[worst]:.2g} element sizes outside the mesh, more than {reach:g}")
    return Embedding(mesh.elements[owner], shape_at(place), best)


def _nearest(x: Array, near: NDArray[np.integer], points: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Places of points well outside a mesh, by linear extrapolation from the centre of the nearest element.

    There Newton's method may fail, and reference coordinates say little: in an element that was compressed to fit a
    thin part they are large within a millimetre.

    Args:
        x: Corners of all elements [m], shape (E, 8, 3).
        near: Candidate elements of each point, shape (P, k).
        points: [m], shape (P, 3).

    Returns:
        Distances from the nearest candidate, in sizes of an ordinary element (P,); coordinates there (P, 3), and which
        candidate it is (P,).
    """
    corners = x[near]
    jacobian = np.einsum("pkai,aj->pkij", corners, CENTRE_GRADIENT)
    at = np.linalg.solve(jacobian, (points[:, None] - corners.mean(axis=2))[..., None])[..., 0]
    inside = shape_at(np.clip(at, -1.0, 1.0).reshape(-1, 3)).reshape(*near.shape, 8)
    away = np.linalg.norm(np.einsum("pka,pkai->pki", inside, corners) - points[:, None], axis=2)
    chosen = away.argmin(axis=1)
    rows = np.arange(len(points))
    size = float(np.median(np.ptp(x, axis=1).max(axis=1)))
    return away[rows, chosen] / size, np.clip(at[rows, chosen], -2.0, 2.0), chosen


def embed_between(mesh: HexMesh, ends: Embedding, edges: NDArray[np.integer], points: Array) -> Embedding:
    """Embed points between others in the elements of these, even if another part of the mesh is nearer.

    Args:
        mesh: The volume mesh at rest.
        ends: Embedding of the other points.
        edges: Indices of the two points that each point lies between, shape (P, 2).
        points: [m], shape (P, 3).
    """
    corners, weights = ends.corners[edges[:, 0]].copy(), ends.weights[edges[:, 0]].copy()
    best = np.full(len(points), np.inf)
    for side in edges.T:
        at = _local(mesh.nodes[ends.corners[side]], points)
        beyond = 0.5 * np.maximum(np.abs(at).max(axis=1) - 1.0, 0.0)
        better = beyond < best
        best[better], corners[better] = beyond[better], ends.corners[side[better]]
        weights[better] = shape_at(at[better])
    best = np.where(np.isfinite(best), best, ends.outside[edges[:, 0]])
    return Embedding(corners, weights, best)


def _local(x: Array, points: Array) -> Array:
    """Reference coordinates of points in elements (Newton's method); infinite where it does not converge."""
    at = np.zeros(points.shape)
    going = np.arange(len(points))
    for _ in range(12):
        here, now = x[going], at[going]
        wrong = np.einsum("pa,pai->pi", shape_at(now), here) - points[going]
        jacobian = np.einsum("pai,paj->pij", here, slope_at(now))
        at[going] = np.clip(now - _solved(jacobian, wrong), -5.0, 5.0)
        going = going[np.abs(at[going] - now).max(axis=1) > _STILL]
        if len(going) == 0:
            break
    size = np.linalg.norm(np.ptp(x, axis=1), axis=1)
    wrong = np.einsum("pa,pai->pi", shape_at(at), x) - points
    at[np.linalg.norm(wrong, axis=1) > 1e-6 * size] = np.inf
    return at


def _solved(matrix: Array, right: Array) -> Array:
    """Solution of systems of three equations by Cramer's rule, shape (P, 3); the right side where one is singular.

    Many times as fast as LAPACK, which is called once a system.
    """
    a, b, c = (np.ascontiguousarray(matrix[:, :, k].T) for k in range(3))
    r = np.ascontiguousarray(right.T)
    bc, ca, ab = _cross(b, c), _cross(c, a), _cross(a, b)
    det = (a * bc).sum(axis=0)
    singular = np.abs(det) < 1e-300
    det[singular] = 1.0
    out: Array = np.stack([(r * v).sum(axis=0) / det for v in (bc, ca, ab)], axis=1)
    out[singular] = right[singular]
    return out


def _cross(a: Array, b: Array) -> Array:
    """Cross products of columns, shape (3, P)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
