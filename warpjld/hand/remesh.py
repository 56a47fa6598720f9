"""Isotropic remeshing on an implicit surface (after Botsch and Kobbelt 2004), vectorised over independent operations.

Each pass applies a set of operations that do not affect one another, so that it is a few array expressions: long edges
are split, short ones collapsed, edges flipped towards Delaunay, and vertices moved tangentially to the mean of their
neighbours. Priorities are deterministic, with ties broken by index: the same input gives the same result to the bit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from warpjld.hand.mesh import Faces, ManifoldEdges, area_normals, dots, mean_over_neighbours

__all__ = ["remesh", "settle"]

Array = NDArray[np.float64]

_LONG, _SHORT = 4.0 / 3.0, 4.0 / 5.0  # relative to the target edge length: Botsch and Kobbelt 2004
_COLLAPSES = 8  # collapse passes in a round: one pass collapses few edges, since neighbouring ones exclude each other


def remesh(
    vertices: Array, faces: Faces, size: Array, field: Callable[[Array], Array], rounds: int
) -> tuple[Array, Faces, Array]:
    """Remesh a surface to target edge lengths.

    Args:
        vertices, faces: A closed manifold on the surface.
        size: Target edge length at each vertex, shape (V,).
        field: Signed distance on whose zero level the vertices are kept.
        rounds: Number of rounds of split, collapse, flip and smoothing.

    Returns:
        Vertices, faces, and the target lengths at the new vertices.
    """
    for _ in range(rounds):
        vertices, faces, size = _split(vertices, faces, size)
        for _ in range(_COLLAPSES):
            before = len(faces)
            vertices, faces, size = _collapse(vertices, faces, size)
            if len(faces) > 0.99 * before:
                break
        faces = _flip(vertices, _flip(vertices, faces))
        vertices = settle(vertices, faces, size, field)
    return vertices, faces, size


def settle(vertices: Array, faces: Faces, size: Array, field: Callable[[Array], Array], amount: float = 0.7) -> Array:
    """Tangential smoothing: vertices moved towards the mean of their neighbours, weighted by 1 / target length, and
    back onto the zero level of ``field``, shape (V, 3)."""
    edges = ManifoldEdges.of(faces, len(vertices))
    normals = area_normals(vertices, faces)
    ring = np.zeros((len(vertices), 3))
    for k in range(3):
        for c in range(3):
            ring[:, c] += np.bincount(faces[:, k], normals[:, c], minlength=len(vertices))
    unit = ring / np.maximum(np.sqrt(dots(ring, ring)), 1e-12)[:, None]
    weight = 1.0 / size
    centre = mean_over_neighbours(edges, vertices * weight[:, None]) / mean_over_neighbours(edges, weight)[:, None]
    move = amount * (centre - vertices)
    move -= unit * dots(move, unit)[:, None]
    moved = vertices + move
    return moved - unit * np.clip(field(moved), -0.5 * size, 0.5 * size)[:, None]


def _split(vertices: Array, faces: Faces, size: Array) -> tuple[Array, Faces, Array]:
    """Split edges that are too long, and the longest of both their faces, at their midpoints."""
    edges = ManifoldEdges.of(faces, len(vertices))
    ratio = _ratios(vertices, size, edges)
    longest = edges.of_face[np.arange(len(faces)), np.argmax(ratio[edges.of_face], axis=1)]
    chosen = np.flatnonzero((ratio > _LONG) & (longest[edges.faces] == np.arange(len(ratio))[:, None]).all(axis=1))
    if not len(chosen):
        return vertices, faces, size
    ends = edges.ends[chosen]
    new = len(vertices) + np.repeat(np.arange(len(chosen)), 2)
    face, corner = edges.faces[chosen].ravel(), edges.corners[chosen].ravel()
    a, b, o = (faces[face, (corner + k) % 3] for k in range(3))
    out = faces.copy()
    out[face] = np.column_stack([a, new, o])
    return (
        np.vstack([vertices, vertices[ends].mean(axis=1)]),
        np.vstack([out, np.column_stack([new, b, o])]),
        np.concatenate([size, size[ends].mean(axis=1)]),
    )


def _collapse(vertices: Array, faces: Faces, size: Array) -> tuple[Array, Faces, Array]:
    """Collapse edges that are too short to their midpoints, where no face flips and no edge becomes too long."""
    count = len(vertices)
    edges = ManifoldEdges.of(faces, count)
    ratio = _ratios(vertices, size, edges)
    valence, across = edges.valence(), edges.opposite(faces)
    merged = valence[edges.ends].sum(axis=1) - 4
    wanted = (ratio < _SHORT) & (valence[across] > 3).all(axis=1) & (merged >= 3) & (merged <= 9)
    rank = np.full(len(ratio), len(ratio))
    short = np.flatnonzero(wanted)
    rank[short[np.argsort(ratio[short], kind="stable")]] = np.arange(len(short))
    chosen = short[_apart(edges, rank)[short]]
    # link condition: the ends may share only the two vertices opposite to the edge, or the result is not manifold
    ring = edges.adjacency
    a, b = edges.ends[chosen].T
    chosen = chosen[(ring[a].multiply(ring[b])).sum(axis=1) == 2]
    if not len(chosen):
        return vertices, faces, size
    a, b = edges.ends[chosen].T
    middle = 0.5 * (vertices[a] + vertices[b])
    moved = vertices.copy()
    moved[a] = moved[b] = middle
    owner = np.full(count, -1)
    owner[a] = owner[b] = np.arange(len(chosen))
    dead = np.zeros(len(faces), dtype=bool)
    dead[edges.faces[chosen]] = True
    touched = np.flatnonzero((owner[faces[:, 0]] & owner[faces[:, 1]] & owner[faces[:, 2]]) != -1)
    touched = touched[~dead[touched]]
    around = faces[touched]
    old, new = area_normals(vertices, around), area_normals(moved, around)
    turned = dots(old, new) < 0.5 * np.sqrt(dots(old, old) * dots(new, new))
    limit = (1.25 * _LONG * size) ** 2
    for k in range(3):
        here, there = around[:, k], around[:, (k + 1) % 3]
        side = moved[here] - moved[there]
        turned |= dots(side, side) > np.minimum(limit[here], limit[there])
    guilty = owner[around[turned]].ravel()
    fine = np.ones(len(chosen), dtype=bool)
    fine[guilty[guilty >= 0]] = False
    a, b, chosen = a[fine], b[fine], chosen[fine]
    out, wished = vertices.copy(), size.copy()
    out[a], wished[a] = 0.5 * (vertices[a] + vertices[b]), 0.5 * (size[a] + size[b])
    to = np.arange(count)
    to[b] = a
    dead[:] = False
    dead[edges.faces[chosen]] = True
    kept = to == np.arange(count)
    number = np.cumsum(kept) - 1
    return out[kept], number[to[faces[~dead]]], wished[kept]


def _apart(edges: ManifoldEdges, rank: Faces) -> Faces:
    """Which edges have the lowest rank among all edges at their ends and at the neighbours of their ends, shape (E,);
    these can be collapsed independently."""
    lowest = np.full(edges.count, rank.max() + 1)
    for k in range(2):
        np.minimum.at(lowest, edges.ends[:, k], rank)
    around = lowest.copy()
    for k in range(2):
        np.minimum.at(around, edges.ends[:, k], lowest[edges.ends[:, 1 - k]])
    return rank == around[edges.ends].min(axis=1)


def _flip(vertices: Array, faces: Faces) -> Faces:
    """Flip edges that are not Delaunay (opposite angles sum to more than π), where the surface is nearly flat."""
    edges = ManifoldEdges.of(faces, len(vertices))
    (a, b), (c, d) = edges.ends.T, edges.opposite(faces).T
    surplus = -(_cosine(vertices, c, a, b) + _cosine(vertices, d, a, b))
    normals = area_normals(vertices, faces)
    normals /= np.maximum(np.sqrt(dots(normals, normals)), 1e-12)[:, None]
    flat = dots(normals[edges.faces[:, 0]], normals[edges.faces[:, 1]]) > 0.6
    valence = edges.valence()
    wanted = (surplus > 1e-3) & flat & (valence[edges.ends] > 3).all(axis=1) & ~edges.joined(c, d)
    score = np.where(wanted, surplus, -1.0)
    best = edges.of_face[np.arange(len(faces)), np.argmax(score[edges.of_face], axis=1)]
    chosen = np.flatnonzero(wanted & (best[edges.faces] == np.arange(len(score))[:, None]).all(axis=1))
    first, second = edges.faces[chosen].T
    corner = edges.corners[chosen, 0]
    start, end = faces[first, corner], faces[first, (corner + 1) % 3]
    up, down = edges.opposite(faces)[chosen].T
    one, two = np.column_stack([start, down, up]), np.column_stack([down, end, up])
    # both new faces must have the orientation of the old ones
    facing = normals[first] + normals[second]
    fine = np.ones(len(chosen), dtype=bool)
    for new in (one, two):
        turned = area_normals(vertices, new)
        fine &= dots(turned, facing) > 0.5 * np.sqrt(dots(turned, turned) * dots(facing, facing))
    pair = np.minimum(up, down) * edges.count + np.maximum(up, down)
    only = np.zeros(len(chosen), dtype=bool)
    only[np.unique(pair, return_index=True)[1]] = True
    # flips that would leave a vertex with fewer than three edges wait for the next pass
    busy = np.zeros(edges.count, dtype=np.int64)
    np.add.at(busy, np.column_stack([start, end])[fine & only].ravel(), 1)
    fine &= only & (valence[start] - busy[start] >= 3) & (valence[end] - busy[end] >= 3)
    out = faces.copy()
    out[first[fine]], out[second[fine]] = one[fine], two[fine]
    return out


def _ratios(vertices: Array, size: Array, edges: ManifoldEdges) -> Array:
    """Length of every edge relative to the target length, shape (E,)."""
    a, b = edges.ends.T
    along = vertices[a] - vertices[b]
    return np.sqrt(dots(along, along)) / (0.5 * (size[a] + size[b]))


def _cosine(vertices: Array, apex: Faces, a: Faces, b: Faces) -> Array:
    """Cosine of the angle at ``apex`` between a and b, shape (n,)."""
    u, v = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
    return dots(u, v) / np.maximum(np.sqrt(dots(u, u) * dots(v, v)), 1e-12)
