"""O-grid topology: layers of hexahedra around a box, for balls (cubed spheres), cylinders and fingers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Ints, Ints32
from warpjld.fem.mesh.hexmesh import elements_of

__all__ = ["Ogrid", "ogrid_hexes"]

_SIDES = {  # axis, end, and the two axes that form a right-handed triple with the outward direction
    "x-": (0, 0, 2, 1),
    "x+": (0, 1, 1, 2),
    "y-": (1, 0, 0, 2),
    "y+": (1, 1, 2, 0),
    "z-": (2, 0, 1, 0),
    "z+": (2, 1, 0, 1),
}


@dataclass(frozen=True, eq=False)
class Ogrid:
    """Topology: position of each node in box and layers, and structured blocks.

    Attributes:
        place: Position of each node in the box, in elements, shape (N, 3); of a layer node that of its foot point.
        layer: Layer of each node, 0 in the box, shape (N,).
        elements: Nodes, those of the core's elements first, shape (E, 8).
        core: Number of elements of the core.
        outer: Faces of the last layer, shape (F, 2).
        inner: Inward faces of the first layer, empty with a core, shape (F, 2).
        ends: Faces of sides without layers, by the name of the box's side, shape (F, 2) each.
        blocks: Structured grids of node indices.
    """

    place: Ints32
    layer: Ints32
    elements: Ints32
    core: int
    outer: Ints32
    inner: Ints32
    ends: dict[str, Ints32]
    blocks: tuple[Ints32, ...]


def ogrid_hexes(counts: tuple[int, int, int], layers: int, sides: tuple[str, ...], *, core: bool) -> Ogrid:
    """Layers of elements around the named sides of a box of elements.

    Args:
        counts: Elements of the box along x, y, z.
        layers: Layers around it.
        sides: Sides with layers, of ``x-``, ``x+``, ``y-``, ``y+``, ``z-``, ``z+``.
        core: Whether the box itself is meshed or hollow.

    Raises:
        InputError: Counts that are not positive.
    """
    if min(counts) < 1 or layers < 1:
        raise InputError(f"want at least one element each way, got {counts} and {layers} layers")
    shape = tuple(n + 1 for n in counts)
    place = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1).reshape(-1, 3)
    carries = np.zeros(len(place), dtype=bool)
    for side in sides:
        axis, end, _, _ = _SIDES[side]
        carries |= place[:, axis] == end * counts[axis]
    feet = np.flatnonzero(carries)
    inside, first = (len(place), 1) if core else (0, 0)
    grid = np.arange(len(place), dtype=np.int32).reshape(shape)
    numbers = _numbers(len(place), feet, range(first, layers + 1), inside)
    blocks = [grid.astype(np.int32)] if core else []
    blocks += [_layers(grid, numbers, side) for side in sides]
    elements = [elements_of(block) for block in blocks]
    place = place.astype(np.int32)
    levels = [np.full(len(feet), n, np.int32) for n in range(first, layers + 1)]
    outer, inner, ends = _boundary([tuple(n - 1 for n in block.shape) for block in blocks], sides, core)
    return Ogrid(
        place=np.concatenate([place] * core + [place[feet]] * len(levels)),
        layer=np.concatenate([np.zeros(inside, np.int32), *levels]),
        elements=np.concatenate(elements).astype(np.int32),
        core=len(elements[0]) if core else 0,
        outer=outer,
        inner=np.empty((0, 2), np.int32) if core else inner,
        ends=ends,
        blocks=tuple(blocks),
    )


def _numbers(count: int, feet: Ints, levels: range, inside: int) -> Ints32:
    """Index of the node over each node of the box in every layer, the box's own first, shape (layers + 1, count)."""
    column = np.full(count, -1)
    column[feet] = np.arange(len(feet))
    out = np.empty((levels.stop, count), dtype=np.int32)
    out[0] = np.arange(count)
    for level in levels:
        out[level] = inside + (level - levels.start) * len(feet) + column
    return out


def _layers(grid: Ints32, numbers: Ints32, side: str) -> Ints32:
    """The structured block of node indices over a side of the box."""
    axis, end, u, v = _SIDES[side]
    sheet = np.take(grid, -end, axis=axis)
    sheet = sheet.T if u > v else sheet
    return np.stack([level[sheet] for level in numbers], axis=-1).astype(np.int32)


def _boundary(
    shapes: list[tuple[int, ...]], sides: tuple[str, ...], core: bool
) -> tuple[Ints32, Ints32, dict[str, Ints32]]:
    """Faces of the last layer, of the first layer, and of sides without layers by the name of the box's side."""
    sizes = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)])
    cells = [start + np.arange(np.prod(shape)).reshape(shape) for start, shape in zip(sizes[:-1], shapes, strict=True)]
    ends: dict[str, list[Ints32]] = {side: [] for side in _SIDES if side not in sides}
    if core:
        for side, found in ends.items():
            axis, end, _, _ = _SIDES[side]
            found.append(_faces(np.take(cells[0], -end, axis=axis), 2 * axis + end))
    around = cells[core:]
    for side, block in zip(sides, around, strict=True):
        axis, _, u, _ = _SIDES[side]
        for open_side, found in ends.items():
            other, far, _, _ = _SIDES[open_side]
            if other != axis:
                local = 0 if other == u else 1
                found.append(_faces(np.take(block, -far, axis=local), 2 * local + far))
    outer, inner = (np.concatenate([_faces(b[:, :, k], local) for b in around]) for k, local in ((-1, 5), (0, 4)))
    return outer, inner, {side: np.concatenate(found).astype(np.int32) for side, found in ends.items()}


def _faces(cells: Ints, local: int) -> Ints32:
    flat = cells.ravel()
    return np.stack([flat, np.full_like(flat, local)], axis=1).astype(np.int32)
