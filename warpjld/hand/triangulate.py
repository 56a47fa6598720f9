"""Isotropic triangulation of the hand's implicit surface, from about two thousand vertices to millions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.hand.contour import contour
from warpjld.hand.flesh import PlannedFlesh
from warpjld.hand.mesh import Faces, ManifoldEdges, area_normals, mean_over_neighbours, subdivide
from warpjld.hand.remesh import remesh, settle

__all__ = ["triangulate"]

Array = NDArray[np.float64]

_LARGEST_REMESHED = 16_000  # vertices; larger surfaces are remeshed at this size and subdivided, which is far faster
_COARSEST, _FINEST = 2.0, 1.0  # grid spacing [mm]: two millimetres still separate neighbouring fingers
_PACKING = 0.96  # target length squared times vertices per area, in a remeshed surface (equilateral: 2 / √3 = 1.15)


def triangulate(flesh: PlannedFlesh, resolution: int) -> tuple[Array, Faces]:
    """Triangulate the surface with about ``resolution`` vertices: vertices [mm] and faces, closed, of genus 0."""
    base, halvings = resolution, 0
    while base > _LARGEST_REMESHED:
        base, halvings = base // 4, halvings + 1
    vertices, faces = _closed_contour(flesh, base)
    vertices = flesh.project(vertices, steps=1)
    shape = _relative_size(flesh, vertices, faces)
    areas = 0.5 * np.linalg.norm(area_normals(vertices, faces), axis=1)
    density = (areas / (shape[faces] ** 2).mean(axis=1)).sum()
    size = shape * np.sqrt(_PACKING * density / base)
    for rounds in (6, 2, 2, 2):
        vertices, faces, size = remesh(vertices, faces, size, flesh, rounds)
        excess = len(vertices) / base
        if rounds == 2 and abs(excess - 1.0) < 0.03:
            break
        size = size * np.sqrt(excess)
    for _ in range(3):
        vertices = settle(vertices, faces, size, flesh)
    # no details finer than the triangles, which would be noise
    flesh = replace(flesh, detail=float(np.clip((resolution - 8_000) / 24_000, 0.0, 1.0)))
    vertices = flesh.project(vertices, steps=2)
    for halving in range(halvings):
        vertices, faces = subdivide(vertices, faces)
        vertices = flesh.project(vertices, steps=2 if halving == 0 else 1)  # later midpoints are nearly on the surface
    return vertices, faces


def _closed_contour(flesh: PlannedFlesh, base: int) -> tuple[Array, Faces]:
    """Contour of the surface as a single closed piece without holes, on a finer grid where that needs one.

    Raises:
        InputError: The proportions give no such surface.
    """
    spacing = float(np.clip(np.sqrt(40_000.0 / base), _FINEST, _COARSEST) * flesh.plan.stretch.min())
    for _ in range(3):
        vertices, faces = contour(flesh, *flesh.bounds, spacing)
        if len(vertices) - len(faces) // 2 == 2:  # Euler characteristic of a sphere
            return vertices, faces
        spacing *= 0.7
    raise InputError(
        "proportions: with these the hand is not one closed surface (fingers merge, or parts are separate)"
    )


def _relative_size(flesh: PlannedFlesh, vertices: Array, faces: Faces) -> Array:
    """Target edge lengths up to a common factor, smaller where the curvature is larger, shape (V,)."""
    normal = unit(flesh.slope(vertices)[1])
    edges = ManifoldEdges.of(faces, len(vertices))
    a, b = edges.ends.T
    lengths = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    turns = np.linalg.norm(normal[a] - normal[b], axis=1)
    bend = np.zeros(len(vertices))
    total = np.zeros(len(vertices))
    for end in (a, b):
        bend += np.bincount(end, turns, minlength=len(vertices))
        total += np.bincount(end, lengths, minlength=len(vertices))
    bend /= np.maximum(total, 1e-9)
    for _ in range(12):
        bend = 0.5 * (bend + mean_over_neighbours(edges, bend))
    return 1.0 / np.sqrt(np.clip(bend, 0.02, 0.16) / 0.06)
