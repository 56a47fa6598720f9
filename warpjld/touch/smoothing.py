"""A fixed smoothing of fields over a surface, of finite reach: what it does not reach stays exactly as it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array

from warpjld.touch.patches import Patches, neighbours

__all__ = ["edge_lengths", "skin_smoothing", "smoothing"]

_REACH = 0.25  # of the thickness: how far from a displacement its volume is given back
_MOST = 8  # Jacobi steps: beyond that a row reaches over hundreds of vertices
_LEAST = 0.05  # of a row's largest entry: what is less is dropped


def edge_lengths(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Mean length of the edges at every vertex [m], 0 where there are none, shape (V,)."""
    linked = neighbours(faces, len(vertices)).tocoo()
    row, column = linked.coords
    length = np.linalg.norm(vertices[row] - vertices[column], axis=1)
    degree = np.bincount(row, minlength=len(vertices))
    return np.asarray(np.bincount(row, length, len(vertices)) / np.maximum(degree, 1))


def skin_smoothing(vertices: NDArray[np.float64], patches: Patches) -> csr_array:
    """Rows that smooth a field over a surface on the scale of its thickness, shape (V, V)."""
    edge = edge_lengths(vertices, patches.faces)
    # one ring of faces at least: what coarse faces give way by is given back on the next
    return smoothing(vertices, patches.faces, np.maximum(_REACH * patches.thickness, edge))


def smoothing(vertices: NDArray[np.float64], faces: NDArray[np.int32], reach: NDArray[np.float64]) -> csr_array:
    """Rows that average a field over about ``reach`` [m] of every vertex, each summing to one, shape (V, V).

    Each step mixes a share a of the neighbours' mean in: after n steps the spread is the edges' length times √(n a).
    The finest region says how many steps, up to a bound; elsewhere a is less than a half.
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
    # far tails are dropped, so that nothing far away moves by a billionth
    largest = out.max(axis=1).toarray().ravel()
    out.data[out.data < _LEAST * np.repeat(largest, np.diff(out.indptr))] = 0.0
    out.eliminate_zeros()
    return csr_array(diags_array(1.0 / np.maximum(out.sum(axis=1), 1e-300)) @ out)
