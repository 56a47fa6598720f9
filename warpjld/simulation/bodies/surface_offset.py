"""Offset between a visible surface and the element faces that carry it; contact acts between visible surfaces.

Element faces are flat; on a fingertip of radius r the skin bulges beyond them by edge² / (8 r), and folds that elements
cannot resolve increase the distance. Gaps between two deformable surfaces are weighted averages over the faces around a
node (mortar), so the offset averaged with the same shape functions is added to them. Gaps to obstacles are those of the
nodes, so only the offset at the nodes counts there: with the bulge of the faces added, round flesh on a plate would
touch with all nodes around the first one, and forces would be too large by 8 % for eight elements across a finger's
half circumference, and by 40 % for five.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.mesh.hexmesh import HexMesh, nodal_area_vectors

__all__ = ["element_edge", "face_offsets", "face_triangles", "facet_edge", "node_offsets", "outer_surface"]

_FINE = 0.4
"""Spacing of the sample points on the visible surface, in element edges."""
_MOST_PIECES = 8
"""Most subdivisions of an edge of a visible facet."""
_FACING = 0.3
"""Least cosine between the normals of a visible facet and of the nearest element face; others lie across a fold."""


def face_triangles(mesh: HexMesh, faces: str) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Nodes of a face set, shape (m,), and triangles indexing them, two per face, shape (2 F, 3)."""
    nodes, corners = np.unique(mesh.quads(mesh.face_set(faces)), return_inverse=True)
    corners = corners.reshape(-1, 4)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return nodes.astype(np.int64), triangles.astype(np.int32)


def outer_surface(mesh: HexMesh, faces: str) -> Facets:
    """Triangulated face set of a mesh in its reference configuration."""
    nodes, triangles = face_triangles(mesh, faces)
    return Facets(mesh.nodes[nodes], triangles)


def element_edge(mesh: HexMesh, faces: str) -> float:
    """Median edge length of a face set in the reference configuration [m]."""
    nodes, triangles = face_triangles(mesh, faces)
    return facet_edge(mesh.nodes[nodes], triangles)


def facet_edge(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> float:
    """Median length of the first edges of triangles (T, 3) between vertices (V, 3) [m]."""
    x = vertices[triangles]
    return float(np.median(np.linalg.norm(x[:, 1] - x[:, 0], axis=1)))


def face_offsets(
    mesh: HexMesh, faces: str, vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Mean height of a visible surface above the faces around every node [m], negative below, shape (N,).

    Args:
        mesh: The volume in its reference configuration.
        faces: Name of its face set.
        vertices: The visible surface in the same configuration [m], shape (V, 3).
        triangles: Triangles of the surface that the volume carries, shape (T, 3).
    """
    out = np.zeros(len(mesh.nodes))
    nodes, outer = face_triangles(mesh, faces)
    shape, edge = Facets(mesh.nodes[nodes], outer), element_edge(mesh, faces)
    points, normals, area = _sampled(vertices[triangles], _FINE * edge)
    if not len(points):
        return out
    found, place = shape.locate(points)
    facing = np.einsum("pi,pi->p", normals, found.normal) > _FACING
    height = np.clip(found.distance, -edge, edge)
    weight = place.weights * (area * facing)[:, None]
    corner = nodes[shape.faces[place.face]]
    total = np.bincount(corner.ravel(), weight.ravel(), len(out))
    summed = np.bincount(corner.ravel(), (weight * height[:, None]).ravel(), len(out))
    np.divide(summed, total, out=out, where=total > 0.0)
    return out


def node_offsets(
    mesh: HexMesh, faces: str, vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Height of a visible surface above every node of a face set [m], negative below, shape (N,).

    Where the nearest facet lies across a fold, the mean of ``face_offsets`` is used instead.

    Args:
        mesh: The volume in its reference configuration.
        faces: Name of its face set.
        vertices: The visible surface in the same configuration [m], shape (V, 3).
        triangles: Triangles of the surface that the volume carries, shape (T, 3).
    """
    out = face_offsets(mesh, faces, vertices, triangles)
    if not len(triangles):
        return out
    quads = mesh.quads(mesh.face_set(faces))
    x = mesh.nodes[quads]
    facing = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    nodes = np.unique(quads)
    normal = nodal_area_vectors(mesh.nodes, quads)[nodes]
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    found = Facets(vertices, triangles).project(mesh.nodes[nodes])
    edge = float(np.sqrt(0.5 * np.median(np.linalg.norm(facing, axis=1))))
    height = np.einsum("ni,ni->n", found.closest - mesh.nodes[nodes], found.normal)
    sure = (np.einsum("ni,ni->n", normal, found.normal) > _FACING) & (np.abs(height) < edge)
    out[nodes[sure]] = height[sure]
    return out


def _sampled(
    corners: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Sample points on triangles (T, 3, 3), spaced by about ``step`` [m].

    Returns:
        Points (P, 3) [m], normals of their triangles (P, 3), and the areas that they stand for (P,) [m²].
    """
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    pieces = np.clip(np.ceil(longest / step), 1, _MOST_PIECES).astype(int)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(size, 1e-300)[:, None]
    parts: list[tuple[NDArray[np.float64], ...]] = []
    for count in np.unique(pieces):
        rows = np.flatnonzero(pieces == count)
        ups = [(i + 1 / 3, j + 1 / 3) for i in range(count) for j in range(count - i)]
        downs = [(i + 2 / 3, j + 2 / 3) for i in range(count) for j in range(count - i - 1)]
        uv = np.array(ups + downs) / count
        weights = np.column_stack([1.0 - uv.sum(axis=1), uv])
        points = np.einsum("sk,tki->tsi", weights, corners[rows]).reshape(-1, 3)
        each = np.repeat(0.5 * size[rows] / len(uv), len(uv))
        parts.append((points, np.repeat(normal[rows], len(uv), axis=0), each))
    if not parts:
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    points, normals, areas = (np.concatenate(list(column)) for column in zip(*parts, strict=True))
    return points, normals, areas
