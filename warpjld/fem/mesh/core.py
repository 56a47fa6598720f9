"""Which cells of a regular grid a fitted mesh is grown from: those inside a surface, in one piece, into every limb.

A cell is taken if it is inside with some room. Limbs thinner than about four cells may hold none, or pieces that do not
hang together: there a path of cells whose middles are inside is added, and fitting squeezes it in.
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
    """Cells all of whose eight corners are inside; ``inside`` is of grid nodes, shape (ni + 1, nj + 1, nk + 1)."""
    low, high = slice(None, -1), slice(1, None)
    out = np.ones([n - 1 for n in inside.shape], dtype=bool)
    for i in (low, high):
        for j in (low, high):
            for k in (low, high):
                out &= inside[i, j, k]
    return out


def make_manifold(cells: Mask, spare: Mask | None = None) -> Mask:
    """Change as few cells as it takes until no two meet at an edge or a corner only, and neither do two empty ones.

    Args:
        cells: Chosen cells, an empty rim around them.
        spare: Cells that may be added; others are only removed.
    """
    cells = cells.copy()
    left = np.zeros_like(cells) if spare is None else spare & ~cells
    while True:
        around = np.stack([_shifted(cells, corner) for corner in np.ndindex(2, 2, 2)], axis=-1)
        wrong = _BROKEN[around @ _BITS]
        if not wrong.any():
            return cells
        count = ndimage.convolve(
            cells.astype(int), ndimage.generate_binary_structure(3, 1).astype(int), mode="constant"
        )
        for i, j, k in np.argwhere(wrong):
            block = tuple(slice(n - 1, n + 1) for n in (i, j, k))
            cells[block], left[block] = _mended(cells[block], left[block], count[block])


def _mended(present: Mask, spare: Mask, count: Ints) -> tuple[Mask, Mask]:
    """Eight cells around a node and what is still spare of them, changed least: cells that have few neighbours are
    removed, or spare ones added."""
    price = np.where(present, 6.0 + count, np.where(spare, 8.0, np.inf)).ravel()
    pattern = present.ravel()
    if not _BROKEN[int(pattern @ _BITS)]:
        return present, spare
    best, mended = np.inf, present
    for flips, number in zip(_FLIPS, _FLIPS @ _BITS, strict=True):
        cost = price[flips].sum()
        if cost < best and not _BROKEN[int(pattern @ _BITS) ^ int(number)]:
            best, mended = cost, (pattern ^ flips).reshape(2, 2, 2)
    return mended, spare & ~mended & ~present


def _shifted(cells: Mask, corner: tuple[int, int, int]) -> Mask:
    """Cell at one of the eight places around each grid node."""
    out = np.zeros([n + 1 for n in cells.shape], dtype=bool)
    place = tuple(slice(1 - c, n + 1 - c) for c, n in zip(corner, cells.shape, strict=True))
    out[place] = cells
    return out


def _broken_patterns() -> Mask:
    """Which of the 256 ways to fill the cells around a node leave them, or the empty ones, in more than one piece."""
    table = np.zeros(256, dtype=bool)
    corners = list(np.ndindex(2, 2, 2))
    for pattern in range(256):
        # place (0, 0, 0) of _shifted is the cell above the node along every axis: its mirror is as good here
        filled = np.zeros((2, 2, 2), dtype=bool)
        for bit, corner in enumerate(corners):
            filled[corner] = bool(pattern >> bit & 1)
        table[pattern] = ndimage.label(filled)[1] > 1 or ndimage.label(~filled)[1] > 1
    return table


_BROKEN = _broken_patterns()
_BITS = 1 << np.arange(8)
_FLIPS = np.array([[bool(n >> bit & 1) for bit in range(8)] for n in range(1, 256)])


_MARGIN = 0.1
"""Depth of the corners, edges' middles, faces' middles and middle of a cell that is taken, in spacings: fingers that
are a little apart stay apart."""
_PATH = 0.15
"""Depth of the middle of a cell that a path may go through, in spacings."""
_BARE = 1.8
"""Distance from the nearest cell taken, in spacings, from which on a path is laid."""
_ROUNDS = 6
_LARGEST = 60_000_000


def core_of(envelope: Envelope, spacing: float, notes: list[str]) -> tuple[Mask, Array]:
    """Cells of the core, shape (ni, nj, nk), and the grid's first node [m], shape (3,).

    Args:
        envelope: The surface.
        spacing: Edge of a cell [m].
        notes: What is left out is added to them.

    Raises:
        InputError: A spacing too coarse for the surface, or so fine that memory would not do.
    """
    low = envelope.vertices.min(axis=0) - 2.0 * spacing
    counts = np.ceil((envelope.vertices.max(axis=0) + 2.0 * spacing - low) / spacing).astype(int) + 1
    if int(counts.prod()) > _LARGEST:
        raise InputError(f"spacing: {spacing:g} m would make a grid of {int(counts.prod()):,} nodes")
    lines = [low[k] + spacing * np.arange(counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    depth = -envelope.ask(grid.reshape(-1, 3)).distance.reshape(counts)
    room = _Room(envelope, grid, depth, spacing)
    banned = np.zeros([n - 1 for n in counts], dtype=bool)
    spare = room.middle > _PATH
    cells = make_manifold(room.inside, spare)
    for _ in range(_ROUNDS):
        reached = room.reached(cells, banned)
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


class _Room:
    """The grid's cells, and which are inside how far.

    Attributes:
        inside: Cells to take, shape (ni, nj, nk).
        middle: Depth of the cells' middles in spacings, -1 where no corner is inside, shape (ni, nj, nk).
    """

    def __init__(self, envelope: Envelope, grid: Array, depth: Array, spacing: float) -> None:
        self.inside = core_cells(depth > _MARGIN * spacing)
        some = ~core_cells(depth <= 0.0)
        places = np.stack(np.nonzero(some), axis=1)
        # a surface may pass between corners that are all inside: the gap between two fingers
        offsets = np.array([p for p in np.ndindex(3, 3, 3) if 1 in p], dtype=np.float64) / 2.0
        points = grid[tuple(places.T)][:, None] + spacing * offsets
        found = -envelope.ask(points.reshape(-1, 3)).distance.reshape(len(places), len(offsets)) / spacing
        self.inside[tuple(places.T)] &= found.min(axis=1) > _MARGIN
        self.middle = np.full(self.inside.shape, -1.0)
        self.middle[tuple(places.T)] = found[:, (offsets == 0.5).all(axis=1)][:, 0]
        self._across = np.full((3, *self.inside.shape), -1.0)
        for axis in range(3):
            face = (offsets == np.where(np.arange(3) == axis, 1.0, 0.5)).all(axis=1)
            self._across[axis][tuple(places.T)] = found[:, face][:, 0]

    def reached(self, cells: Mask, banned: Mask) -> Mask:
        """Cells with paths added that join pieces, and that lead where surface is far from any cell."""
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


class _Paths:
    """Ways through cells that are open, the deeper the cheaper."""

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
        """The end that is cheapest to reach, none if no end is."""
        self._search(start)
        return self._least(ends, self._cost)

    def deepest(self, start: Mask, ends: Mask) -> int | None:
        """The deepest end that can be reached."""
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
        """Add the cells from the last search's start to a target."""
        while target >= 0:
            cells[tuple(self._places[target])] = True
            target = int(self._before[target])
