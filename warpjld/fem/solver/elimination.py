"""Fill-reducing elimination order of a sparse matrix, and its supernodal fronts (multifrontal, see ``fem_factor``)."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from warpjld.fem.arrays import Ints, Ints32, Mask

__all__ = ["Elimination", "eliminate", "work_by_profile"]

_LANES = 8  # as in warpjld_kernels.fem_factor
_NARROW = 8
"""Number of nodes of a front up to which it is merged with the one above, whatever explicit zeros this adds."""
_ZEROS = 0.15
"""Largest share of explicit zeros in a wider front at which it is merged."""
_SHARE = 0.7
"""Share of the work in fronts that are factorised in parallel; the rest follows."""
_CACHED = 4
"""Number of eliminations that are cached: two of a frame with contact, one of each of its bodies alone; 3 MB each for
25,000 degrees of freedom."""
_RECENT: list[tuple[tuple[bytes, ...], Elimination]] = []
_LOCK = Lock()


@dataclass(frozen=True, eq=False)
class Elimination:
    """An elimination order and its fronts; members as in the kernel's ``Fronts`` and ``Blocks``.

    Attributes:
        order: Nodes in the order of elimination, shape (n,).
        place: Position of every node in it, -1 for inactive nodes, shape (N,).
        tables: The kernel's tables of fronts, by name.
        early: Fronts that are factorised in parallel, and the start of each parallel part.
        late: The remaining fronts, likewise.
        size: Number of values in the factor's panels.
        room: Largest number of values in update matrices at a time.
        work: Number of multiplications.
        parent: Front that takes up each front's update matrix, -1 for none, shape (F,).
    """

    order: Ints32
    place: Ints32
    tables: dict[str, Any]
    early: tuple[Ints32, Ints32]
    late: tuple[Ints32, Ints32]
    size: int
    room: int
    work: float
    parent: Ints

    def above(self, positions: Ints) -> Ints:
        """Fronts that eliminate the nodes at some positions of the order, and all fronts above these, ascending."""
        needed = np.zeros(len(self.parent), dtype=bool)
        new = np.unique(np.searchsorted(self.tables["first"], positions, side="right") - 1)
        while len(new):
            needed[new] = True
            new = np.unique(self.parent[new])
            new = new[(new >= 0) & ~needed[new]]
        return np.flatnonzero(needed)


def eliminate(rows: Ints32, columns: Ints32, active: Mask) -> Elimination:
    """A minimum-degree order (Liu 1985) and its fronts; the last few are cached, as frames repeat patterns.

    Args:
        rows: Start of each row of a symmetric pattern, shape (N + 1,).
        columns: Its column indices.
        active: Mask of nodes to eliminate, shape (N,).
    """
    key = tuple(np.ascontiguousarray(a).tobytes() for a in (rows, columns, active))
    with _LOCK:
        for place, (known, elimination) in enumerate(_RECENT):
            if known == key:
                _RECENT.insert(0, _RECENT.pop(place))
                return elimination
    found = _eliminated(rows, columns, active)
    with _LOCK:
        _RECENT[:] = [(key, found), *_RECENT[: _CACHED - 1]]
    return found


def _eliminated(rows: Ints32, columns: Ints32, active: Mask) -> Elimination:
    nodes = np.flatnonzero(active)
    full = csr_array((np.ones(len(columns)), columns, rows), shape=(len(active),) * 2)
    pattern = csr_array(full[nodes][:, nodes])
    place = np.full(len(active), -1, np.int32)
    mine, lower = _minimum_degree(pattern)
    place[nodes] = mine
    order = np.empty(len(nodes), np.int32)
    order[mine] = nodes
    first, lists = _fronts(lower)
    return _tables(order, place, first, lists)


def work_by_profile(rows: Ints32, columns: Ints32, active: Mask) -> float:
    """Multiplications of a factorisation in Cuthill–McKee order: fast to compute, and more than in a minimum-degree
    order for long or thin bodies.

    Args:
        rows, columns, active: As in ``eliminate``.
    """
    nodes = np.flatnonzero(active)
    full = csr_array((np.ones(len(columns), np.int8), columns, rows), shape=(len(active),) * 2)
    pattern = csr_array(full[nodes][:, nodes])
    place = np.empty(len(nodes), np.int64)
    place[reverse_cuthill_mckee(pattern, symmetric_mode=True)] = np.arange(len(nodes))
    row = np.repeat(np.arange(len(nodes)), np.diff(pattern.indptr))
    profile = np.zeros(len(nodes))
    np.maximum.at(profile, place[row], place[row] - place[pattern.indices])
    return float(13.5 * (profile * profile).sum())


def _minimum_degree(pattern: Any) -> tuple[Ints32, Any]:
    """Position of each node, and the pattern of the factor's lower triangle in that order, as ``csc_array``, obtained
    by factorising a Laplacian."""
    count = pattern.shape[0]
    laplacian = csc_array(diags_array(pattern.sum(axis=1) + 1.0) - pattern)
    found = splu(laplacian, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
    lower = csc_array(found.L)
    lower.sort_indices()
    assert lower.shape == (count, count)
    return np.asarray(found.perm_c, np.int32), lower


def _fronts(lower: Any) -> tuple[Ints, list[Ints32]]:
    """First columns of the fronts, shape (F + 1,), and row indices of each, its own columns first."""
    count = lower.shape[0]
    sizes = np.diff(lower.indptr)
    second = np.full(count, count)
    has_below = sizes > 1
    second[has_below] = lower.indices[lower.indptr[:-1][has_below] + 1]
    begins = np.ones(count + 1, dtype=bool)
    begins[1:-1] = (second[:-1] != np.arange(1, count)) | (sizes[1:] != sizes[:-1] - 1)
    starts = np.flatnonzero(begins)
    # merge a front with the next one if that is its parent
    kept: list[tuple[int, int, int, Ints32]] = []  # first, last column + 1, zeros, rows below
    for low, high in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        rows = lower.indices[lower.indptr[high - 1] + 1 : lower.indptr[high]]
        zeros = 0
        while kept and len(kept[-1][3]) and kept[-1][3][0] < high and kept[-1][1] == low:
            begin, end, held, below = kept[-1]
            more = held + zeros + (end - begin) * (high - low + len(rows) - len(below))
            wide = high - begin
            if wide > _NARROW and more > _ZEROS * wide * (0.5 * wide + len(rows)):
                break
            low, zeros = begin, more
            kept.pop()
        kept.append((low, high, zeros, rows))
    lists = [np.concatenate([np.arange(a, b, dtype=np.int32), rows]) for a, b, _, rows in kept]
    return np.array([a for a, *_ in kept] + [count]), lists


def _tables(order: Ints32, place: Ints32, first: Ints, lists: list[Ints32]) -> Elimination:
    count = len(lists)
    own = np.diff(first)
    every = np.array([len(rows) for rows in lists])
    owner = np.repeat(np.arange(count), own)
    flat, starts = np.concatenate(lists).astype(np.int32), np.concatenate([[0], np.cumsum(every)])
    parent = np.full(count, -1)  # the front that eliminates the first row below
    parent[every > own] = owner[flat[(starts[:-1] + own)[every > own]]]
    children = np.flatnonzero(parent >= 0)
    children = children[np.argsort(parent[children], kind="stable")]
    child = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(parent[parent >= 0], minlength=count), out=child[1:])
    high, wide, rest = _padded(3 * every), 3 * own, _padded(3 * (every - own))
    panel = np.concatenate([[0], np.cumsum(high * wide)])
    n, m = wide.astype(float), 3.0 * every
    work = n * (m * (m - n) + n * n / 3.0)
    below = work.copy()
    for front in range(count):  # children come before their parents
        if parent[front] >= 0:
            below[parent[front]] += below[front]
    parts = _partition(parent, below, work)
    left, room, sizes = np.zeros(count, np.int64), 0, rest * 3 * (every - own)
    parts = [_postorder(part, parent, sizes) for part in parts]
    for part in parts:
        room = _allocate_stacks(part, parent, sizes, left, room)
    tables = {
        "first": first.astype(np.int32),
        "starts": starts.astype(np.int32),
        "rows": flat,
        "child": child,
        "children": children.astype(np.int32),
        "panel": panel[:-1].astype(np.int64),
        "left": left,
    }
    *early, late = parts
    ends = np.cumsum([0, *map(len, early)]).astype(np.int32)
    sides = (np.concatenate(early).astype(np.int32), ends), (late.astype(np.int32), np.array([0, len(late)], np.int32))
    return Elimination(order, place, tables, *sides, int(panel[-1]), room, float(work.sum()), parent)


def _padded(count: Ints) -> Ints:
    return (count + _LANES - 1) // _LANES * _LANES


def _partition(parent: Ints, below: Any, work: Any) -> list[Ints]:
    """Divide fronts into two parts of whole subtrees with equal work, and the fronts above; independent of threads."""
    roots = np.flatnonzero(parent < 0).tolist()
    branches, above = roots, 0.0
    total = float(work.sum())
    kids: dict[int, list[int]] = {}
    for front, up in enumerate(parent.tolist()):
        kids.setdefault(up, []).append(front)
    while True:
        sums = [0.0, 0.0]
        sides: list[list[int]] = [[], []]
        for branch in sorted(branches, key=lambda one: (-below[one], one)):
            side = int(sums[1] < sums[0])
            sums[side] += below[branch]
            sides[side].append(branch)
        largest = max(branches, key=lambda one: (below[one], -one), default=None)
        if largest is None or min(sums) >= 0.8 * max(sums) or above > (1.0 - _SHARE) * total:
            break
        if not kids.get(largest):
            break
        above += float(work[largest])
        branches = [one for one in branches if one != largest] + kids[largest]
    side_of = np.full(len(parent), 2)
    for side, roots_of in enumerate(sides):
        side_of[roots_of] = side
    for front in range(len(parent) - 1, -1, -1):  # parents come after their children
        if side_of[front] == 2 and parent[front] >= 0:
            side_of[front] = side_of[parent[front]] if side_of[parent[front]] != 2 else 2
    return [np.flatnonzero(side_of == side) for side in range(3)]


def _postorder(part: Ints, parent: Ints, sizes: Ints) -> Ints:
    """Postorder of a part's fronts that minimises the memory of waiting update matrices (Liu 1986)."""
    inside = np.zeros(len(parent), dtype=bool)
    inside[part] = True
    ups, size = parent.tolist(), sizes.tolist()
    kids: dict[int, list[int]] = {}
    peak: dict[int, int] = {}
    tops = []
    for front in part.tolist():
        waiting, most = 0, 0
        kids.setdefault(front, []).sort(key=lambda one: (size[one] - peak[one], one))
        for child in kids[front]:
            most = max(most, waiting + peak[child])
            waiting += size[child]
        peak[front] = max(most, waiting + size[front])
        if ups[front] >= 0 and inside[ups[front]]:
            kids.setdefault(ups[front], []).append(front)
        else:
            tops.append(front)
    out, todo = [], tops
    while todo:  # parents before children, last child first; reversed at the end
        front = todo.pop()
        out.append(front)
        todo += kids[front]
    return np.array(out[::-1], np.int64)


def _allocate_stacks(part: Ints, parent: Ints, sizes: Ints, left: Ints, start: int) -> int:
    """Offsets of update matrices on two stacks, for fronts at even and odd depth, so that a front's children are always
    on top of the other stack. Written to ``left``; returns the end of the stacks."""
    inside = np.zeros(len(parent), dtype=bool)
    inside[part] = True
    depth = np.zeros(len(parent), np.int64)
    for front in part[::-1].tolist():
        up = parent[front]
        depth[front] = depth[up] + 1 if up >= 0 and inside[up] else 0
    heights, tops = [0, 0], [0, 0]
    waiting: list[list[tuple[int, int]]] = [[], []]  # fronts on each stack, and the stack's height below them
    for front in part.tolist():
        parity = int(depth[front] % 2)
        other = waiting[1 - parity]
        while other and parent[other[-1][0]] == front:
            heights[1 - parity] = other.pop()[1]
        left[front] = start + heights[parity]
        waiting[parity].append((front, heights[parity]))
        heights[parity] += int(sizes[front])
        tops[parity] = max(tops[parity], heights[parity])
    left[part[depth[part] % 2 == 1]] += tops[0]
    return start + sum(tops) + _LANES
