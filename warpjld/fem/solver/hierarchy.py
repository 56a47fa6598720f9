"""Levels of geometric multigrid: node sets of increasing coarseness, and prolongations between them."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from scipy.sparse import block_diag, csr_array, eye_array, kron

from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["hierarchy_of"]

_COARSEST = 400
"""Number of nodes below which a direct solve is cheaper than another level."""


def hierarchy_of(mesh: HexMesh) -> list[Any]:
    """Prolongations from each level's nodes to the next finer one's, finest first, as ``csr_array``s.

    Structured blocks take every other line; meshes made from a regular grid every other grid plane; any other mesh is
    embedded in a regular grid of about twice its element size, whose trilinear functions contain all rigid motions.
    Weights depend on the numbering only, not on nodes moved to fit a shape. Parts of merged meshes are independent.
    """
    if mesh.parts:
        return _side_by_side([hierarchy_of(part) for part in mesh.parts], [len(part.nodes) for part in mesh.parts])
    if mesh.blocks:
        return _from_blocks(mesh.blocks, len(mesh.nodes))
    if mesh.lattice is not None:
        return _from_lattice(mesh.lattice)
    edge = mesh.nodes[mesh.elements[:, 1]] - mesh.nodes[mesh.elements[:, 0]]
    spacing = 2.0 * float(np.median(np.linalg.norm(edge, axis=1)))
    place = (mesh.nodes - mesh.nodes.min(axis=0)) / spacing
    weights, coarse = _trilinear(place)
    return [weights, *_from_lattice(coarse)]


def _from_blocks(blocks: tuple[Ints32, ...], count: int) -> list[Any]:
    out = []
    while count > _COARSEST:
        kept = [[_kept_lines(n - 1) for n in grid.shape] for grid in blocks]
        coarse_grids = [grid[np.ix_(*lines)] for grid, lines in zip(blocks, kept, strict=True)]
        fine_of = np.unique(np.concatenate([grid.ravel() for grid in coarse_grids]))
        if len(fine_of) > 0.7 * count:
            break
        number = np.full(count, -1, np.int32)
        number[fine_of] = np.arange(len(fine_of), dtype=np.int32)
        done = np.zeros(count, dtype=bool)
        rows, columns, weights = [], [], []
        for grid, coarse, lines in zip(blocks, coarse_grids, kept, strict=True):
            along = [_line_weights(n - 1, line) for n, line in zip(grid.shape, lines, strict=True)]
            local = reduce(lambda a, b: kron(a, b, format="csr"), along).tocoo()
            fine = grid.ravel()[local.row]
            fresh = ~done[fine]
            rows.append(fine[fresh])
            columns.append(number[coarse.ravel()[local.col[fresh]]])
            weights.append(local.data[fresh])
            done[grid.ravel()] = True
        parts = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
        out.append(_tidy(csr_array(parts, shape=(count, len(fine_of)))))
        blocks = tuple(number[grid] for grid in coarse_grids)
        count = len(fine_of)
    return out


def _side_by_side(parts: list[list[Any]], counts: list[int]) -> list[Any]:
    """Levels of several bodies combined; a body without a further level is passed on by the identity."""
    out = []
    for level in range(max(map(len, parts))):
        weights = []
        for k, levels in enumerate(parts):
            weights.append(levels[level] if level < len(levels) else eye_array(counts[k], format="csr"))
            counts[k] = weights[-1].shape[1]
        out.append(_tidy(block_diag(weights, format="csr")))
    return out


def _kept_lines(n: int) -> Ints:
    """Lines of 0…n that the coarser block keeps: every other one, symmetric from both ends."""
    if n % 2 == 0:
        return np.arange(0, n + 1, 2)
    if n == 1:
        return np.array([0, 1])
    half = np.arange(0, (n - 1) // 2 + 1, 2)
    return np.concatenate([half, (n - half)[::-1]])


def _line_weights(n: int, lines: Ints) -> Any:
    fine = np.arange(n + 1)
    left = np.clip(np.searchsorted(lines, fine, side="right") - 1, 0, len(lines) - 2)
    share = (fine - lines[left]) / (lines[left + 1] - lines[left])
    parts = (np.stack([1.0 - share, share], 1).ravel(), (np.repeat(fine, 2), np.stack([left, left + 1], 1).ravel()))
    matrix = csr_array(parts, shape=(n + 1, len(lines)))
    matrix.eliminate_zeros()
    return matrix


def _from_lattice(lattice: Ints32) -> list[Any]:
    out = []
    while len(lattice) > _COARSEST:
        weights, coarse = _trilinear(0.5 * (lattice - lattice.min(axis=0)))
        if len(coarse) > 0.7 * len(lattice):
            break
        out.append(weights)
        lattice = coarse
    return out


def _trilinear(place: Array) -> tuple[Any, Ints32]:
    """Trilinear weights of points in a unit grid, and integer coordinates of the grid nodes used."""
    low = np.floor(place).astype(np.int64)
    share = place - low
    dims = low.max(axis=0) + 2
    rows, keys, weights = [], [], []
    for corner in np.ndindex(2, 2, 2):
        bit = np.array(corner)
        weight = np.where(bit, share, 1.0 - share).prod(axis=1)
        used = np.flatnonzero(weight > 1e-12)
        at = low[used] + bit
        rows.append(used)
        keys.append((at[:, 0] * dims[1] + at[:, 1]) * dims[2] + at[:, 2])
        weights.append(weight[used])
    names, column = np.unique(np.concatenate(keys), return_inverse=True)
    parts = (np.concatenate(weights), (np.concatenate(rows), column.ravel()))
    coarse = np.stack([names // (dims[1] * dims[2]), names // dims[2] % dims[1], names % dims[2]], axis=1)
    return _tidy(csr_array(parts, shape=(len(place), len(names)))), coarse.astype(np.int32)


def _tidy(matrix: Any) -> Any:
    matrix.sum_duplicates()
    matrix.sort_indices()
    matrix.indices = matrix.indices.astype(np.int32)
    matrix.indptr = matrix.indptr.astype(np.int32)
    return matrix
