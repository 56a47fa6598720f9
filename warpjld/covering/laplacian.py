"""Cotangent and uniform Laplacians of triangulated surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.corners import corner_conductivity
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["conducting_laplacian", "cotangent_laplacian", "cotangents", "surface_laplacian", "uniform_laplacian"]


def cotangent_laplacian(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], thickness: NDArray[np.float64]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Positive semidefinite cotangent Laplacian, shape (V, V), and barycentric vertex areas, shape (V,).

    Cotangents are clamped to 1e-3 … 1e3: negative weights would violate the maximum principle. The conductivity is
    raised around saddle vertices, within a share of the ``thickness`` there, shape (V,) (``corners.py``).
    """
    conductivity = corner_conductivity(vertices, faces, thickness)
    return cotangents(vertices, faces, lambda i, j: conductivity)


def conducting_laplacian(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    thickness: NDArray[np.float64],
    conductivity: NDArray[np.float64],
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """As :func:`cotangent_laplacian`, each edge's weight times the mean ``conductivity`` of its ends, shape (V,)."""
    corner = corner_conductivity(vertices, faces, thickness)
    return cotangents(vertices, faces, lambda i, j: corner * (conductivity[i] + conductivity[j]) / 2.0)


def surface_laplacian(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Cotangent Laplacian of the surface as it is, shape (V, V), and barycentric vertex areas, shape (V,).

    Weights of edges are clamped at 0, not those of their corners: where triangles are Delaunay, fields that are linear
    in a plane have none, however unequal the triangles are. Without the conductivity around saddle vertices.
    """
    found, area = cotangents(vertices, faces, lambda i, j: 1.0, least=-1e3)
    pairs = found.tocoo()
    rows, columns = pairs.coords
    return _laplacian(rows, columns, np.maximum(-pairs.data, 0.0), len(vertices)), area


def cotangents(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    conductivity: Callable[[NDArray, NDArray], NDArray | float],
    least: float = 1e-3,
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Cotangent Laplacian and vertex areas; ``conductivity(i, j)`` is that of the edges i to j of all triangles,
    ``least`` the smallest cotangent of a corner."""
    count = len(vertices)
    rows, columns, values = [], [], []
    area = np.zeros(count)
    for k in range(3):
        apex, i, j = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        u, v = vertices[i] - vertices[apex], vertices[j] - vertices[apex]
        twice = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.clip((u * v).sum(axis=1) / np.maximum(twice, 1e-30), least, 1e3) / 2.0
        rows += [i, j]
        columns += [j, i]
        values += [cotangent * conductivity(i, j)] * 2
        np.add.at(area, apex, twice / 6.0)
    positive = area[area > 0.0]
    # vertices without faces, or with degenerate faces only, need a positive area too
    area = np.maximum(area, 1e-6 * positive.mean()) if positive.size else np.full(count, 1.0 / count)
    return _laplacian(np.concatenate(rows), np.concatenate(columns), np.concatenate(values), count), area


def uniform_laplacian(faces: NDArray[np.int32], count: int) -> sp.csr_array:
    """Graph Laplacian with equal edge weights, shape (V, V), for meshes too degenerate for cotangents."""
    rows = np.concatenate([faces[:, k] for k in (0, 1, 2, 1, 2, 0)])
    columns = np.concatenate([faces[:, k] for k in (1, 2, 0, 0, 1, 2)])
    return _laplacian(rows, columns, np.full(len(rows), 0.5), count)


def _laplacian(rows: NDArray, columns: NDArray, conducted: NDArray[np.float64], count: int) -> sp.csr_array:
    """Laplacian with these off-diagonal weights; entries of the same place are summed."""
    between = rows != columns
    off = sp.coo_array((conducted[between], (rows[between], columns[between])), shape=(count, count)).tocsr()
    return sp.diags_array(np.asarray(off.sum(axis=1)).ravel()) - off
