"""Smoothing matrices of compact support for fields on a surface: values beyond their reach are exactly unchanged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array

from warpjld.touch.patches import Patches, neighbours

__all__ = ["edge_lengths", "skin_smoothing", "smoothing"]

_REACH = 0.25  # radius of smoothing relative to the thickness
_MOST = 8  # largest number of Jacobi steps; with more a row has hundreds of entries
_LEAST = 0.05  # entries smaller than this share of a row's largest are dropped


def edge_lengths(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Mean length of the edges at every vertex [m], 0 where there are none, shape (V,)."""
    linked = neighbours(faces, len(vertices)).tocoo()
    row, column = linked.coords
    length = np.linalg.norm(vertices[row] - vertices[column], axis=1)
    degree = np.bincount(row, minlength=len(vertices))
    return np.asarray(np.bincount(row, length, len(vertices)) / np.maximum(degree, 1))


def skin_smoothing(vertices: NDArray[np.float64], patches: Patches) -> csr_array:
    """Smoothing matrix with the thickness of the flesh as its length scale, shape (V, V)."""
    edge = edge_lengths(vertices, patches.faces)
    # at least one ring of faces, so that on a coarse mesh volume can be restored on the neighbouring faces
    return smoothing(vertices, patches.faces, np.maximum(_REACH * patches.thickness, edge))


def smoothing(vertices: NDArray[np.float64], faces: NDArray[np.int32], reach: NDArray[np.float64]) -> csr_array:
    """Matrix that averages a field over about ``reach`` [m] of every vertex, rows summing to one, shape (V, V).

    Each Jacobi step mixes in a share a of the neighbours' mean: after n steps the standard deviation is the edge length
    times √(n a). The number of steps, up to a bound, follows from the finest region; elsewhere a is less than a half.
    """
    linked = neighbours(faces, len(vertices))
    edge = edge_lengths(vertices, faces)
    square = (reach / np.where(edge > 0.0, edge, np.inf)) ** 2
    steps = int(np.clip(np.ceil(2.0 * square.max(initial=0.0)), 2, _MOST))
    share = np.minimum(square / steps, 0.5)
    degree = np.diff(linked.indptr)
    mean = csr_array(diags_array(share / np.maximum(degree, 1.0)) @ linked)
    step = csr_array(diags_array(np.where(degree > 0, 1.0 - share, 1.0)) @ eye_array(len(vertices)) + mean)
    out = step
    for _ in range(steps - 1):
        out = csr_array(out @ step)
    # small entries are dropped, so that distant vertices stay exactly unchanged
    largest = out.max(axis=1).toarray().ravel()
    out.data[out.data < _LEAST * np.repeat(largest, np.diff(out.indptr))] = 0.0
    out.eliminate_zeros()
    return csr_array(diags_array(1.0 / np.maximum(out.sum(axis=1), 1e-300)) @ out)
