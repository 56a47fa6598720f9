"""How far a visible surface lies outside the elements that carry it: contact is between what is seen.

Faces of elements are flat; the skin between their nodes bulges beyond them, by edge² / 8 over the radius of a
fingertip, and folds that elements cannot follow keep them off it farther. Gaps between surfaces that both deform are
averages over the faces around a node, so what is averaged with the same shape functions is added to them. Gaps to
obstacles are those of the nodes themselves: there only what the nodes stay off the surface counts. With the bulge of
the faces added, round flesh on a plate would touch with all nodes around a first one, and forces be too great by 8 %
for eight elements across a finger's half circumference, and by 40 % for five.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["element_edge", "face_offsets", "face_triangles", "node_offsets", "outer_surface"]

_FINE = 0.4
"""Distance between the points where the surface is looked at, in edges of elements."""
_MOST_PIECES = 8
_FACING = 0.3
"""Least cosine between a visible facet and the element face that is nearest to it: others lie across a fold."""


def face_triangles(mesh: HexMesh, faces: str) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Nodes of a face set, shape (m,), and triangles over them, two for each face, shape (2 F, 3)."""
    nodes, corners = np.unique(mesh.quads(mesh.face_set(faces)), return_inverse=True)
    corners = corners.reshape(-1, 4)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return nodes.astype(np.int64), triangles.astype(np.int32)


def outer_surface(mesh: HexMesh, faces: str) -> Facets:
    """A face set of a mesh as it rests, as triangles over its own nodes."""
    nodes, triangles = face_triangles(mesh, faces)
    return Facets(mesh.nodes[nodes], triangles)


def element_edge(mesh: HexMesh, faces: str) -> float:
    """Median edge of a face set at rest [m]."""
    nodes, triangles = face_triangles(mesh, faces)
    x = mesh.nodes[nodes[triangles]]
    return float(np.median(np.linalg.norm(x[:, 1] - x[:, 0], axis=1)))


def face_offsets(
    mesh: HexMesh, faces: str, vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Mean height of a visible surface over the faces around every node [m], negative where it lies within, shape (N,).

    Args:
        mesh: The volume, as it rests.
        faces: Its face set.
        vertices: The surface it carries, at the same moment [m], shape (V, 3).
        triangles: Of the surface, as far as the volume carries it, shape (T, 3).
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
    """Height of a visible surface over every node of a face set [m], negative where it lies within, shape (N,).

    Where the nearest facet lies across a fold, the mean over the faces around stands in.

    Args:
        mesh: The volume, as it rests.
        faces: Its face set.
        vertices: The surface it carries, at the same moment [m], shape (V, 3).
        triangles: Of the surface, as far as the volume carries it, shape (T, 3).
    """
    out = face_offsets(mesh, faces, vertices, triangles)
    if not len(triangles):
        return out
    quads = mesh.quads(mesh.face_set(faces))
    x = mesh.nodes[quads]
    facing = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    nodes = np.unique(quads)
    normal = np.zeros_like(mesh.nodes)
    np.add.at(normal, quads, facing[:, None, :].repeat(4, axis=1))
    normal = normal[nodes] / np.linalg.norm(normal[nodes], axis=1, keepdims=True)
    found = Facets(vertices, triangles).project(mesh.nodes[nodes])
    edge = float(np.sqrt(0.5 * np.median(np.linalg.norm(facing, axis=1))))
    height = np.einsum("ni,ni->n", found.closest - mesh.nodes[nodes], found.normal)
    sure = (np.einsum("ni,ni->n", normal, found.normal) > _FACING) & (np.abs(height) < edge)
    out[nodes[sure]] = height[sure]
    return out


def _sampled(
    corners: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Points on triangles (T, 3, 3) about a step apart [m], (P, 3), the triangles' normals (P, 3) and areas (P,)."""
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    pieces = np.clip(np.ceil(longest / step), 1, _MOST_PIECES).astype(int)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(size, 1e-300)[:, None]
    parts: list[tuple[NDArray[np.float64], ...]] = []
    for count in np.unique(pieces):
        some = np.flatnonzero(pieces == count)
        ups = [(i + 1 / 3, j + 1 / 3) for i in range(count) for j in range(count - i)]
        downs = [(i + 2 / 3, j + 2 / 3) for i in range(count) for j in range(count - i - 1)]
        uv = np.array(ups + downs) / count
        weights = np.column_stack([1.0 - uv.sum(axis=1), uv])
        points = np.einsum("sk,tki->tsi", weights, corners[some]).reshape(-1, 3)
        each = np.repeat(0.5 * size[some] / len(uv), len(uv))
        parts.append((points, np.repeat(normal[some], len(uv), axis=0), each))
    if not parts:
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    one, two, three = (np.concatenate(list(column)) for column in zip(*parts, strict=True))
    return one, two, three
