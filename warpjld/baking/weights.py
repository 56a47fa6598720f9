"""Least squares fit of skin weights to given deformations, with fixed bones and bind pose.

For one vertex v with targets y_f, the error of weights w ≥ 0, Σ w = 1, is wᵀ G w with G = Σ_f D_fᵀ D_f and columns
D_fb = M_fb v − y_f. Its minimum over the simplex is u / Σ u, where u ≥ 0 minimises ½ uᵀ G u − Σ u: a non-negative least
squares problem, solved exactly (Lawson & Hanson). See Le & Deng, Smooth Skinning Decomposition with Rigid Bones, 2012.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

__all__ = ["fit_weights"]

_CANDIDATES = 10  # bones tried per vertex
_NEAR = 2  # steps in the tree from the best bone within which candidates are preferred
_RIDGE = 1e-9  # regularisation relative to G's trace: two bones that move alike share the weight
_NUMBERS = 8_000_000  # numbers stored at once, which bounds memory


def fit_weights(
    rest: NDArray[np.float64],
    targets: NDArray[np.float32],
    moves: NDArray[np.float64],
    parents: NDArray[np.int64],
    influences: int,
    progress: Callable[[str, int, int], None] | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Fit bones and weights of every vertex, by descending weight, rows summing to one, shape (V, influences) each.

    Args:
        rest: Vertices at rest [m], shape (V, 3).
        targets: Their target positions [m], shape (F, V, 3).
        moves: Rigid transforms of B bones from rest, shape (F, B, 3, 4).
        parents: Parent of each bone, -1 for none, shape (B,).
        influences: Largest number of bones per vertex.
        progress: Called with the name of the phase, vertices done, and V.
    """
    vertices, bones = len(rest), moves.shape[1]
    near = _tree_distance(parents)
    width = min(max(_CANDIDATES, influences + 2), bones)
    joints = np.zeros((vertices, influences), dtype=np.int64)
    weights = np.zeros((vertices, influences))
    length = max(_NUMBERS // (3 * len(moves) * bones), 1)
    table = moves.transpose(3, 1, 0, 2).reshape(4, -1)
    for start in range(0, vertices, length):
        block = slice(start, min(start + length, vertices))
        homogeneous = np.column_stack([rest[block], np.ones(block.stop - start)])
        # (v, B, 3 F): error of following each bone alone
        off = (homogeneous @ table).reshape(len(homogeneous), bones, -1)
        off -= targets[:, block].transpose(1, 0, 2).reshape(len(homogeneous), 1, -1)
        alone = np.einsum("vbn,vbn->vb", off, off)
        best = alone.argmin(axis=1)
        # bones near the best one in the skeleton first, then by their error alone
        rank = alone / (alone.max(axis=1, keepdims=True) + 1e-300) + 10.0 * (near[best] > _NEAR)
        chosen = np.argsort(rank, axis=1, kind="stable")[:, :width]
        columns = np.take_along_axis(off, chosen[:, :, None], axis=1)
        gram = columns @ columns.swapaxes(1, 2)
        for n in range(len(gram)):
            picked, share = _on_simplex(gram[n], influences)
            order = np.argsort(-share, kind="stable")
            joints[start + n, : len(picked)] = chosen[n, picked[order]]
            weights[start + n, : len(picked)] = share[order]
        if progress:
            progress("fitting weights", block.stop, vertices)
    return joints, weights


def _on_simplex(gram: NDArray[np.float64], most: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Best convex weights with at most ``most`` non-zero ones: columns are dropped greedily.

    Args:
        gram: G, shape (n, n).
        most: Largest number of columns kept.

    Returns:
        Columns kept, and their weights.
    """
    kept = np.arange(len(gram))
    while True:
        share = _convex(gram[np.ix_(kept, kept)])
        support = share > 1e-4
        if support.sum() <= most:
            kept, share = kept[support], share[support]
            return kept, share / share.sum()
        kept, share = kept[support], share[support]
        kept = np.delete(kept, _cheapest(gram[np.ix_(kept, kept)], share))


def _cheapest(gram: NDArray[np.float64], share: NDArray[np.float64]) -> int:
    """Column whose removal increases the error least, with the other weights rescaled."""
    rest = 1.0 - share
    slope = gram @ share
    error = share @ slope
    cost = (error - 2.0 * share * slope + share**2 * np.diag(gram)) / np.maximum(rest, 1e-9) ** 2
    return int(cost.argmin())


def _convex(gram: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minimiser w of wᵀ G w under w ≥ 0, Σ w = 1."""
    trace = float(np.trace(gram))
    if trace <= 0.0:  # nothing moves
        return np.eye(len(gram))[0]
    factor = cholesky(gram + _RIDGE * trace * np.eye(len(gram)), check_finite=False)
    scale = trace / len(gram)
    right = solve_triangular(factor, np.full(len(gram), scale), trans="T", check_finite=False)
    found, _ = nnls(factor, right)
    return np.asarray(found / found.sum())


def _tree_distance(parents: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of steps between bones in the tree, shape (B, B); B where they are not connected."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import shortest_path

    count = len(parents)
    hang = np.flatnonzero(parents >= 0)
    links = coo_array((np.ones(len(hang)), (hang, parents[hang])), shape=(count, count)).tocsr()
    steps = shortest_path(links, directed=False, unweighted=True)
    return np.where(np.isfinite(steps), steps, count).astype(np.int64)
