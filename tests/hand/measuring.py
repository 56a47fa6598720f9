"""Measurements on a mesh that know nothing of how the hand was made."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree


def loops(vertices: np.ndarray, faces: np.ndarray, origin: np.ndarray, normal: np.ndarray) -> list[np.ndarray]:
    """Closed outlines, each (n, 3), of the mesh's section by a plane."""
    cut = pv.PolyData.from_regular_faces(vertices, faces).slice(normal=normal, origin=origin).strip(join=True)
    lines, out, at = np.asarray(cut.lines), [], 0
    while at < len(lines):
        count = lines[at]
        out.append(np.asarray(cut.points, dtype=np.float64)[lines[at + 1 : at + 1 + count]])
        at += count + 1
    return out


def centroid_and_radius(outline: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, float]:
    """Centroid of the area inside a plane outline, and the radius of the circle of that area."""
    first = outline[0]
    a, b = outline[:-1] - first, outline[1:] - first
    areas = 0.5 * np.cross(a, b) @ (normal / np.linalg.norm(normal))
    centre = first + (areas[:, None] * (a + b) / 3.0).sum(axis=0) / areas.sum()
    return centre, float(np.sqrt(abs(areas.sum()) / np.pi))


def self_intersections(vertices: np.ndarray, faces: np.ndarray) -> int:
    """Pairs (edge, triangle) without a common vertex that cross."""
    corners = vertices[faces]
    centres = corners.mean(axis=1)
    radius = float(np.linalg.norm(corners - centres[:, None], axis=2).max())
    pairs = cKDTree(centres).query_pairs(2.0 * radius, output_type="ndarray")
    low, high = corners.min(axis=1), corners.max(axis=1)
    i, j = pairs.T
    pairs = pairs[((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)]
    pairs = pairs[~(faces[pairs[:, 0], :, None] == faces[pairs[:, 1], None, :]).any(axis=(1, 2))]
    crossings = 0
    for one, other in (pairs.T, pairs.T[::-1]):
        a, b, c = corners[other].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        for k in range(3):
            start, end = corners[one, k], corners[one, (k + 1) % 3]
            from_start = np.einsum("ij,ij->i", start - a, normal)
            from_end = np.einsum("ij,ij->i", end - a, normal)
            crosses = from_start * from_end < 0.0
            t = np.where(crosses, from_start / np.where(crosses, from_start - from_end, 1.0), 0.0)
            hit = start + t[:, None] * (end - start)
            inside = crosses
            for p, q in ((a, b), (b, c), (c, a)):
                inside = inside & (np.einsum("ij,ij->i", np.cross(q - p, hit - p), normal) > 0.0)
            crossings += int(inside.sum())
    return crossings
