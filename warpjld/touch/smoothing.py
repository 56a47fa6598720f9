"""A fixed smoothing of fields over a surface, of finite reach: what it does not reach stays exactly as it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array

from warpjld.touch.patches import neighbours

__all__ = ["smoothing"]

_MOST = 12  # Jacobi steps: beyond that a row reaches over hundreds of vertices
_LEAST = 0.05  # of a row's largest entry: what is less is dropped


def smoothing(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], reach: float, *, steps: int | None = None
) -> csr_array:
    """Rows that average a field over about ``reach`` [m], each summing to one, shape (V, V).

    Steps of half the mean of the neighbours, as many as diffuse that far on edges of mean length: after n steps the
    spread is the edge's length times √(n / 2).
    """
    linked = neighbours(faces, len(vertices)).tocoo()
    row, column = linked.coords
    edge = float(np.linalg.norm(vertices[row] - vertices[column], axis=1).mean()) if len(row) else 1.0
    if steps is None:
        steps = int(np.clip(round(2.0 * (reach / max(edge, 1e-12)) ** 2), 2, _MOST))
    degree = np.bincount(row, minlength=len(vertices)).astype(float)
    mean = csr_array(diags_array(1.0 / np.maximum(degree, 1.0)) @ linked.tocsr())
    step = csr_array(diags_array(np.where(degree > 0, 0.5, 1.0)) @ eye_array(len(vertices)) + 0.5 * mean)
    out = step
    for _ in range(steps - 1):
        out = csr_array(out @ step)
    # far tails are dropped, so that nothing far away moves by a billionth
    largest = out.max(axis=1).toarray().ravel()
    out.data[out.data < _LEAST * np.repeat(largest, np.diff(out.indptr))] = 0.0
    out.eliminate_zeros()
    return csr_array(diags_array(1.0 / np.maximum(out.sum(axis=1), 1e-300)) @ out)
