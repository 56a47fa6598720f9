"""Winding numbers by solid angles, and distances to triangles: oracles in NumPy, of nothing but their formulas."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def closed(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """Triangles (t, 3, 3) of a surface whose holes are closed by fans to their borders' middles."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = {tuple(edge) for edge in edges.tolist()}
    border = [(a, b) for a, b in there if (b, a) not in there]
    following = dict(border)
    fans: list[list[Array]] = []
    while following:
        first, loop = next(iter(following)), []
        at = first
        while at in following:
            loop.append((at, following[at]))
            at = following.pop(at)
        middle = vertices[[a for a, _ in loop]].mean(axis=0)
        fans += [[vertices[b], vertices[a], middle] for a, b in loop]
    return np.concatenate([vertices[faces], np.array(fans).reshape(-1, 3, 3)])


def winding(points: Array, triangles: Array) -> Array:
    """How many times closed triangles go round each point (n,) (van Oosterom & Strackee 1983)."""
    out = np.zeros(len(points))
    for first in range(0, len(points), 500):
        corner = triangles[None] - points[first : first + 500, None, None]
        a, b, c = corner[:, :, 0], corner[:, :, 1], corner[:, :, 2]
        la, lb, lc = (np.sqrt(np.einsum("nti,nti->nt", v, v)) for v in (a, b, c))
        top = np.einsum("nti,nti->nt", a, np.cross(b, c))
        low = la * lb * lc
        for u, v, w in ((a, b, lc), (b, c, la), (c, a, lb)):
            low = low + np.einsum("nti,nti->nt", u, v) * w
        out[first : first + 500] = np.arctan2(top, low).sum(axis=1) / (2.0 * np.pi)
    return out


def distance(point: Array, triangles: Array) -> float:
    """Distance of one point to the nearest triangle: its foot in the plane where that is inside, else an edge."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    height = ((point - a) * normal).sum(axis=1)
    foot = point - height[:, None] * normal
    sides = [(np.cross(q - p, foot - p) * normal).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
    best = np.where(np.min(sides, axis=0) >= 0.0, np.abs(height), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        t = np.clip(((point - p) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(point - p - t[:, None] * along, axis=1))
    return float(best.min())
