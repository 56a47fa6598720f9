"""Selection of the interior cells of a regular grid from which a fitted mesh is grown (grid-based meshing).

A cell is selected if it is inside with some margin. Limbs thinner than about four cells may contain none, or
disconnected ones: there, a path of cells with centres inside is added, which fitting compresses.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Mask
from warpjld.fem.mesh.envelope import Envelope

__all__ = ["core_cells", "core_of", "make_manifold"]


def core_cells(inside: Mask) -> Mask:
    """Cells whose eight corners are inside; ``inside`` is a mask of grid nodes, shape (ni + 1, nj + 1, nk + 1)."""
    low, high = slice(None, -1), slice(1, None)
    out = np.ones([n - 1 for n in inside.shape], dtype=bool)
    for i in (low, high):
        for j in (low, high):
            for k in (low, high):
                out &= inside[i, j, k]
    return out


def make_manifold(cells: Mask, spare: Mask | None = None) -> Mask:
    """Change as few cells as needed until no two cells, and no two empty ones, meet at an edge or corner only.

    Args:
        cells: Mask of cells, with an empty margin.
        spare: Cells that may be added; all others may only be removed.
    """
    cells = cells.copy()
    left = np.zeros_like(cells) if spare is None else spare & ~cells
    while True:
        around = np.stack([_shifted(cells, corner) for corner in np.ndindex(2, 2, 2)], axis=-1)
        wrong = _NONMANIFOLD[around @ _BITS]
        if not wrong.any():
            return cells
        count = ndimage.convolve(
            cells.astype(int), ndimage.generate_binary_structure(3, 1).astype(int), mode="constant"
        )
        for i, j, k in np.argwhere(wrong):
            block = tuple(slice(n - 1, n + 1) for n in (i, j, k))
            cells[block], left[block] = _repaired(cells[block], left[block], count[block])


def _repaired(present: Mask, spare: Mask, count: Ints) -> tuple[Mask, Mask]:
    """The 2 × 2 × 2 cells around a node, repaired at the lowest cost, and the remaining spare ones: cells with few
    neighbours are removed, or spare ones added."""
    price = np.where(present, 6.0 + count, np.where(spare, 8.0, np.inf)).ravel()
    pattern = present.ravel()
    if not _NONMANIFOLD[int(pattern @ _BITS)]:
        return present, spare
    best, repaired = np.inf, present
    for flips, number in zip(_FLIPS, _FLIPS @ _BITS, strict=True):
        cost = price[flips].sum()
        if cost < best and not _NONMANIFOLD[int(pattern @ _BITS) ^ int(number)]:
            best, repaired = cost, (pattern ^ flips).reshape(2, 2, 2)
    return repaired, spare & ~repaired & ~present


def _shifted(cells: Mask, corner: tuple[int, int, int]) -> Mask:
    """Mask of the cells at one of the eight positions around each grid node."""
    out = np.zeros([n + 1 for n in cells.shape], dtype=bool)
    place = tuple(slice(1 - c, n + 1 - c) for c, n in zip(corner, cells.shape, strict=True))
    out[place] = cells
    return out


def _nonmanifold_patterns() -> Mask:
    """Mask of the 256 patterns of cells around a node whose filled or empty cells are not connected."""
    table = np.zeros(256, dtype=bool)
    corners = list(np.ndindex(2, 2, 2))
    for pattern in range(256):
        # position (0, 0, 0) of _shifted is the cell above the node along every axis; mirroring does not matter
        filled = np.zeros((2, 2, 2), dtype=bool)
        for bit, corner in enumerate(corners):
            filled[corner] = bool(pattern >> bit & 1)
        table[pattern] = ndimage.label(filled)[1] > 1 or ndimage.label(~filled)[1] > 1
    return table


_NONMANIFOLD = _nonmanifold_patterns()
_BITS = 1 << np.arange(8)
"""Value of each of the eight cells around a node in the number of a pattern."""
_FLIPS = np.array([[bool(n >> bit & 1) for bit in range(8)] for n in range(1, 256)])
"""All sets of cells that can be changed."""


_MARGIN = 0.1
"""Smallest depth of corners, edge, face and cell centres of a selected cell, in spacings: keeps fingers with a small
gap apart."""
_PATH = 0.15
"""Smallest depth of the centres of cells on a path, in spacings."""
_BARE = 1.8
"""Distance from the nearest selected cell, in spacings, beyond which a path is added."""
_ROUNDS = 6  # largest number of rounds of adding paths and repairing
_BLOCK = 6
"""Nodes along each edge of the blocks whose centre's distance may decide for all nodes."""
_LARGEST = 60_000_000  # nodes of a grid; bounds memory


def core_of(envelope: Envelope, spacing: float, notes: list[str]) -> tuple[Mask, Array]:
    """Cells of the core, shape (ni, nj, nk), and the position of the grid's first node [m], shape (3,).

    Args:
        envelope: The surface.
        spacing: Edge length of a cell [m].
        notes: A note on omitted pieces is appended.

    Raises:
        InputError: A spacing too coarse for the surface, or so fine that memory would not suffice.
    """
    low = envelope.vertices.min(axis=0) - 2.0 * spacing
    counts = np.ceil((envelope.vertices.max(axis=0) + 2.0 * spacing - low) / spacing).astype(int) + 1
    if int(counts.prod()) > _LARGEST:
        raise InputError(f"spacing: {spacing:g} m would make a grid of {int(counts.prod()):,} nodes")
    lines = [low[k] + spacing * np.arange(counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    deep, inside = _classify_nodes(envelope, grid, _MARGIN * spacing)
    depths_of_cells = _CellDepths(envelope, grid, deep, inside, spacing)
    banned = np.zeros([n - 1 for n in counts], dtype=bool)
    spare = depths_of_cells.middle > _PATH
    cells = make_manifold(depths_of_cells.inside, spare)
    for _ in range(_ROUNDS):
        reached = depths_of_cells.reached(cells, banned)
        kept = make_manifold(reached, spare & ~banned)
        banned |= reached & ~kept
        done = np.array_equal(kept, cells)
        cells = kept
        if done:
            break
    label, pieces = ndimage.label(cells)
    if pieces == 0:
        raise InputError(f"spacing: {spacing:g} m is too coarse, no element fits inside the surface")
    if pieces > 1:
        sizes = np.bincount(label.ravel())[1:]
        kept_piece = 1 + int(sizes.argmax())
        notes.append(
            f"{pieces - 1} thin pieces ({int(sizes.sum() - sizes.max())} cells) joined by less than a cell are left out"
        )
        cells = make_manifold(label == kept_piece)
    return cells, low


class _CellDepths:
    """The grid's cells and their depth inside the surface.

    Attributes:
        inside: Cells to select, shape (ni, nj, nk).
        middle: Depth of cell centres in spacings, -1 for cells without a corner inside, shape (ni, nj, nk).
    """

    def __init__(self, envelope: Envelope, grid: Array, deep: Mask, inside: Mask, spacing: float) -> None:
        self.inside = core_cells(deep)
        touching = ~core_cells(~inside)
        places = np.stack(np.nonzero(touching), axis=1)
        ask = _HalfGridDepths(envelope, grid, spacing)
        middle = ask.depth(2 * places + 1)
        # the surface may pass between corners that are all inside, as the gap between two fingers does, but not near a
        # centre that is deep enough
        least = np.minimum(middle, 1.0)
        across = np.where(middle > _MARGIN, 1.0, -1.0)[None].repeat(3, axis=0)
        for offset in (np.array(p) - 1 for p in np.ndindex(3, 3, 3) if 1 in p and p != (1, 1, 1)):
            away = 0.5 * float(np.linalg.norm(offset))
            near = np.flatnonzero((middle > _MARGIN) & ~((middle > away + 2.0 * _MARGIN) & envelope.closed))
            depth = ask.depth(2 * places[near] + 1 + offset)
            least[near] = np.minimum(least[near], depth)
            if np.abs(offset).sum() == 1 and offset.sum() == 1:
                across[int(np.argmax(offset)), near] = depth
        at = tuple(places.T)
        self.inside[at] &= least > _MARGIN
        self.middle = np.full(self.inside.shape, -1.0)
        self.middle[at] = middle
        self._across = np.full((3, *self.inside.shape), -1.0)
        self._across[:, *at] = across

    def reached(self, cells: Mask, banned: Mask) -> Mask:
        """Cells with added paths that connect pieces, and that lead to parts of the surface far from any cell."""
        open_ = ((self.middle > _PATH) & ~banned) | cells
        if not cells.any():
            deepest = np.unravel_index(int(self.middle.argmax()), self.middle.shape)
            if not open_[deepest]:
                return cells
            cells = cells.copy()
            cells[deepest] = True
        paths = _Paths(open_, np.where(cells, 1.0, self.middle), self._across, cells)
        label, _ = ndimage.label(cells)
        sizes = np.bincount(label.ravel())
        sizes[0] = 0
        out = label == int(sizes.argmax())
        left = cells & ~out
        while left.any():
            target = paths.nearest(out, left)
            if target is None:
                break
            paths.add(out, target)
            label, _ = ndimage.label(cells | out)
            joined = np.unique(label[out])
            out |= cells & np.isin(label, joined)
            left = cells & ~out
        while True:
            bare = open_ & (ndimage.distance_transform_edt(~out) > _BARE)
            target = paths.deepest(out, bare)
            if target is None:
                break
            paths.add(out, target)
        return out | left


class _HalfGridDepths:
    """Depths at a grid's nodes and half-way between them, by doubled indices; cached."""

    def __init__(self, envelope: Envelope, grid: Array, spacing: float) -> None:
        self._envelope, self._grid, self._spacing = envelope, grid, spacing
        self._shape = [2 * n for n in grid.shape[:3]]
        self._keys, self._depths = np.empty(0, np.int64), np.empty(0)

    def depth(self, places: Ints) -> Array:
        """Depth under the surface at doubled indices (n, 3), in spacings, shape (n,)."""
        wanted, rows = np.unique(np.ravel_multi_index(tuple(places.T), self._shape), return_inverse=True)
        fresh = wanted[~np.isin(wanted, self._keys, assume_unique=True)]
        twice = np.stack(np.unravel_index(fresh, self._shape), axis=1)
        whole = self._grid[tuple((twice // 2).T)]
        depths = -self._envelope.ask(whole + 0.5 * self._spacing * (twice % 2)).distance / self._spacing
        keys = np.concatenate([self._keys, fresh])
        order = np.argsort(keys)
        self._keys, self._depths = keys[order], np.concatenate([self._depths, depths])[order]
        out: Array = self._depths[np.searchsorted(self._keys, wanted)][rows]
        return out


def _classify_nodes(envelope: Envelope, grid: Array, margin: float) -> tuple[Mask, Mask]:
    """Masks of the nodes of a grid (ni, nj, nk, 3) that are deeper than a margin [m], and that are inside.

    The distance from a closed surface changes by no more than the distance of points: a node far from the surface
    decides for those around it.
    """
    shape = grid.shape[:3]
    distance = np.full(shape, np.nan)
    if envelope.closed:
        first = tuple(slice(_BLOCK // 2, None, _BLOCK) for _ in shape)
        coarse = np.full(shape, np.nan)
        coarse[first] = envelope.ask(grid[first].reshape(-1, 3)).distance.reshape(grid[first].shape[:3])
        i, j, k = (np.minimum(np.arange(n) // _BLOCK * _BLOCK + _BLOCK // 2, n - 1) for n in shape)
        for centre in np.unique(i):
            slab, one = i == centre, np.ix_([centre], j, k)
            apart = np.linalg.norm(grid[slab] - grid[one], axis=-1)
            distance[slab] = np.where(np.abs(coarse[one]) > apart + 2.0 * margin, coarse[one], np.nan)
    left = np.isnan(distance)
    distance[left] = envelope.ask(grid[left]).distance
    return -distance > margin, distance < 0.0


class _Paths:
    """Shortest paths through permitted cells, where deeper cells are cheaper."""

    def __init__(self, open_: Mask, middle: Array, across: Array, cells: Mask) -> None:
        self._shape = open_.shape
        self._number = np.full(open_.shape, -1)
        self._number[open_] = np.arange(int(open_.sum()))
        self._places = np.stack(np.nonzero(open_), axis=1)
        self._depth = middle[open_]
        price = 1.0 / (0.2 + np.maximum(self._depth, 0.0))
        rows, columns = [], []
        for axis in range(3):
            one = tuple(slice(None, -1) if k == axis else slice(None) for k in range(3))
            next_ = tuple(slice(1, None) if k == axis else slice(None) for k in range(3))
            both = open_[one] & open_[next_] & ((across[axis][one] > _MARGIN) | (cells[one] & cells[next_]))
            rows.append(self._number[one][both])
            columns.append(self._number[next_][both])
        i, j = np.concatenate(rows), np.concatenate(columns)
        i, j = np.concatenate([i, j]), np.concatenate([j, i])
        self._graph = csr_array((0.5 * (price[i] + price[j]), (i, j)), shape=(len(price), len(price)))

    def nearest(self, start: Mask, ends: Mask) -> int | None:
        """Index of the end with the cheapest path, None if none is reachable."""
        self._search(start)
        return self._least(ends, self._cost)

    def deepest(self, start: Mask, ends: Mask) -> int | None:
        """Index of the deepest reachable end."""
        self._search(start)
        return self._least(ends, np.where(np.isfinite(self._cost), -self._depth, np.inf))

    def _search(self, start: Mask) -> None:
        self._cost, self._before, _ = dijkstra(
            self._graph, indices=self._number[start], min_only=True, return_predecessors=True
        )

    def _least(self, ends: Mask, values: Array) -> int | None:
        wanted = self._number[ends & (self._number >= 0)]
        if not np.isfinite(values[wanted]).any():
            return None
        return int(wanted[int(values[wanted].argmin())])

    def add(self, cells: Mask, target: int) -> None:
        """Add the cells on the path from the last search's start to a target."""
        while target >= 0:
            cells[tuple(self._places[target])] = True
            target = int(self._before[target])
