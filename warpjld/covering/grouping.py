"""Clustering of vertices into runs of similar sparsity pattern, so that tiles spend little work on zeros.

A tile of vertices is computed with every column that any of them uses. Vertices with the same columns are one *kind*.
Kinds are divided top-down, always by the column that saves most, into parts of about the size of a tile; then parts are
merged bottom-up, the smallest first, each where it adds least.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["FIXED", "group", "work"]

FIXED = 60
"""Multiply-adds per vertex that do not depend on its columns, mostly for the rotation."""

_PARTS = 600  # smallest number of parts before merging, where there are vertices enough
_SPARSE = 512  # number of kinds above which sparse products are faster than dense ones


def group(
    used: sp.csr_array, price: NDArray[np.float64], lanes: int
) -> tuple[list[NDArray[np.int64]], list[NDArray[np.int64]]]:
    """Vertices and columns of every run, both ascending. A run has at least ``lanes`` vertices.

    Args:
        used: Sparsity pattern, shape (V, columns): a stored entry, of whatever value, is a column the vertex uses.
        price: Multiply-adds of a column per vertex, shape (columns,).
        lanes: Vertices of a tile, which are computed together.

    On a surface smaller than one tile the last vertex is repeated.
    """
    kinds, kind, sizes = _kinds(used)
    present = np.flatnonzero(np.diff(kinds.tocsc().indptr))
    kinds = kinds[:, present].tocsr()
    prices = price[present].astype(np.float32)
    with one_blas_thread():  # thousands of small products, which several threads only slow down
        part = _divided(kinds, sizes.astype(np.float32), prices, max(lanes, int(sizes.sum()) // _PARTS))
        run = _merged(*_columns_of(kinds, sizes, part), prices, lanes)[part]
    member = run[kind]
    members = np.split(np.argsort(member, kind="stable"), np.cumsum(np.bincount(member))[:-1])
    columns = [present[np.flatnonzero(row)] for row in _columns_of(kinds, sizes, run)[0]]
    if len(members[0]) < lanes:
        members[0] = np.concatenate([members[0], np.repeat(members[0][-1:], lanes - len(members[0]))])
    return members, columns


def work(members: list[NDArray[np.int64]], columns: list[NDArray[np.int64]], price: NDArray, lanes: int) -> float:
    """Multiply-adds per frame, including lanes that are computed twice."""
    pairs = zip(members, columns, strict=True)
    return float(sum(_tiles(len(m), lanes) * lanes * (FIXED + price[c].sum()) for m, c in pairs))


def _kinds(used: sp.csr_array) -> tuple[sp.csr_array, NDArray[np.int64], NDArray[np.int64]]:
    """Distinct rows of the pattern, shape (kinds, columns), the kind of every vertex, (V,), and the number of vertices
    of every kind, (kinds,)."""
    signature = np.random.default_rng(0).integers(1, 2**62, used.shape[1])
    pattern = sp.csr_array((np.ones(used.nnz, dtype=np.int64), used.indices, used.indptr), shape=used.shape)
    _, first, kind = np.unique(pattern @ signature, return_index=True, return_inverse=True)
    distinct = pattern[first].astype(np.float32)
    return distinct, kind.ravel(), np.bincount(kind.ravel())


def _columns_of(
    kinds: sp.csr_array, sizes: NDArray[np.int64], part: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Which columns every part uses, 0 or 1, shape (parts, columns), and its number of vertices, shape (parts,)."""
    count = int(part.max()) + 1
    entries = (np.ones(len(part), dtype=np.float32), (part, np.arange(len(part))))
    member = sp.csr_array(entries, shape=(count, len(part)))
    used = ((member @ kinds).toarray() > 0).astype(np.float32)
    return used, np.bincount(part, weights=sizes, minlength=count).astype(np.int64)


def _divided(
    kinds: sp.csr_array, sizes: NDArray[np.float32], price: NDArray[np.float32], enough: int
) -> NDArray[np.int64]:
    """Part of every kind, shape (kinds,). Parts of more than ``enough`` vertices are divided by the column that saves
    most."""
    part = np.zeros(kinds.shape[0], dtype=np.int64)
    count = 0
    waiting = [(np.arange(kinds.shape[0]), kinds, price)]
    while waiting:
        rows, used, prices = waiting.pop()
        column = _best_split(used, sizes[rows], prices) if len(rows) > 1 and sizes[rows].sum() > enough else None
        if column is None:
            part[rows] = count
            count += 1
            continue
        inside = (used[:, [column]].toarray() if sp.issparse(used) else used[:, [column]])[:, 0] > 0
        for chosen in (inside, ~inside):
            part_pattern = used[chosen]
            if sp.issparse(part_pattern):
                held = np.bincount(part_pattern.indices, minlength=part_pattern.shape[1]) > 0
                part_pattern = (
                    part_pattern[:, held] if part_pattern.shape[0] > _SPARSE else part_pattern.toarray()[:, held]
                )
            else:
                held = part_pattern.any(axis=0)
                part_pattern = part_pattern[:, held]
            waiting.append((rows[chosen], part_pattern, prices[held]))
    return part


def _best_split(used: NDArray | sp.csr_array, sizes: NDArray, price: NDArray) -> int | None:
    """Column by whose use kinds are divided at the least total cost; None where all kinds use the same columns."""
    together = used.T @ used
    if sp.issparse(together):
        together = together.toarray()
    here = np.diagonal(together)  # kinds that use a column
    mixed = np.flatnonzero(here < len(sizes))
    if not mixed.size:
        return None
    both = together[mixed]
    with_it = (both > 0).astype(np.float32) @ price
    without = (both < here).astype(np.float32) @ price
    n = (used.T @ sizes)[mixed].astype(np.float64)
    cost = n * (FIXED + with_it) + (sizes.sum() - n) * (FIXED + without)
    return int(mixed[cost.argmin()])


def _merged(
    used: NDArray[np.float32], sizes: NDArray[np.int64], price: NDArray[np.float32], lanes: int
) -> NDArray[np.int64]:
    """Run of every part, shape (parts,): the smallest part is merged where it adds least, until no merge pays."""
    count = len(sizes)
    used, sizes = used.copy(), sizes.copy()
    cost = used @ price
    into = np.arange(count)
    alive = np.ones(count, dtype=bool)
    settled = np.zeros(count, dtype=bool)
    works = _tiles(sizes, lanes) * (FIXED + cost)
    left = count
    while left > 1:
        waiting = np.where(alive & ~settled, sizes, np.iinfo(np.int64).max)
        small = int(waiting.argmin())
        if not alive[small] or settled[small]:
            break
        union = cost + cost[small] - used @ (used[small] * price)
        added = _tiles(sizes + sizes[small], lanes) * (FIXED + union) - works
        added[~alive] = np.inf
        added[small] = np.inf
        near = int(added.argmin())
        if sizes[small] >= lanes and added[near] >= works[small]:
            settled[small] = True
            continue
        into[small] = near
        used[near] = np.maximum(used[near], used[small])
        sizes[near] += sizes[small]
        cost[near] = used[near] @ price
        works[near] = _tiles(sizes[near], lanes) * (FIXED + cost[near])
        alive[small] = False
        left -= 1
    while (further := into[into] != into).any():
        into[further] = into[into[further]]
    return np.unique(into, return_inverse=True)[1].ravel()


def _tiles(sizes: NDArray[np.int64] | int, lanes: int) -> NDArray[np.int64]:
    """Number of tiles of ``lanes`` vertices, rounded up."""
    return -(-np.asarray(sizes) // lanes)
