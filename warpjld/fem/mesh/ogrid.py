"""Layers of elements around a box: the topology of balls (cubed spheres), cylinders and fingers, all hexahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Ints, Ints32
from warpjld.fem.mesh.hexmesh import elements_of

__all__ = ["Ogrid", "ogrid_hexes"]

_SIDES = {  # axis, end, and the two axes that make a right-handed triple with the outward direction
    "x-": (0, 0, 2, 1),
    "x+": (0, 1, 1, 2),
    "y-": (1, 0, 0, 2),
    "y+": (1, 1, 2, 0),
    "z-": (2, 0, 1, 0),
    "z+": (2, 1, 0, 1),
}


@dataclass(frozen=True, eq=False)
class Ogrid:
    """Topology: where each node is in the box and in the layers, and the structured blocks.

    Attributes:
        place: Node's place in the box, counted in elements, shape (N, 3). Layer nodes have that of their foot.
        layer: Layer of each node, 0 in the box, shape (N,).
        elements: Corners, those of the core first, shape (E, 8).
        core: Number of elements of the core.
        outer: Faces of the last layer, shape (F, 2).
        inner: Faces of the first layer that look inwards, empty where there is a core, shape (F, 2).
        ends: Faces left open, by the name of the box's side, shape (F, 2) each.
        blocks: Structured grids of node numbers.
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
        sides: Sides that carry layers, of ``x-``, ``x+``, ``y-``, ``y+``, ``z-``, ``z+``.
        core: Whether the box itself is meshed, or left hollow.

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
    column = np.full(len(place), -1)
    column[feet] = np.arange(len(feet))
    inside = len(place) if core else 0
    first = 1 if core else 0
    numbers = np.empty((layers + 1, len(place)), dtype=np.int32)
    numbers[0] = np.arange(len(place))
    for level in range(first, layers + 1):
        numbers[level] = inside + (level - first) * len(feet) + column

    grid = np.arange(len(place), dtype=np.int32).reshape(shape)
    blocks = [grid.astype(np.int32)] if core else []
    elements = [elements_of(grid)] if core else []
    total = len(elements[0]) if core else 0
    core_elements = total
    outer, inner = [], []
    ends: dict[str, list[Ints32]] = {side: [] for side in _SIDES if side not in sides}
    if core:
        cells = np.arange(total).reshape(counts)
        for side in ends:
            axis, end, _, _ = _SIDES[side]
            chosen = np.take(cells, -end, axis=axis).ravel()
            ends[side].append(np.stack([chosen, np.full_like(chosen, 2 * axis + end)], axis=1))
    for side in sides:
        axis, end, u, v = _SIDES[side]
        sheet = np.take(grid, -end, axis=axis)
        if u > v:
            sheet = sheet.T
        block = np.stack([numbers[level][sheet] for level in range(layers + 1)], axis=-1)
        blocks.append(block.astype(np.int32))
        elements.append(elements_of(block))
        cells = total + np.arange(len(elements[-1])).reshape([n - 1 for n in block.shape])
        total += cells.size
        outer.append(_faces(cells[:, :, -1], 5))
        inner.append(_faces(cells[:, :, 0], 4))
        for open_side, found in ends.items():
            other, far, _, _ = _SIDES[open_side]
            if other != axis:
                local = 0 if other == u else 1
                found.append(_faces(np.take(cells, -far, axis=local), 2 * local + far))
    place = place.astype(np.int32)
    layered = [place[feet]] * (layers + 1 - first)
    return Ogrid(
        place=np.concatenate([place, *layered]) if core else np.concatenate(layered),
        layer=np.concatenate(
            [np.zeros(inside, np.int32), *(np.full(len(feet), n, np.int32) for n in range(first, layers + 1))]
        ),
        elements=np.concatenate(elements).astype(np.int32),
        core=core_elements,
        outer=np.concatenate(outer),
        inner=np.empty((0, 2), np.int32) if core else np.concatenate(inner),
        ends={side: np.concatenate(found).astype(np.int32) for side, found in ends.items()},
        blocks=tuple(blocks),
    )


def _faces(cells: Ints, local: int) -> Ints32:
    flat = cells.ravel()
    return np.stack([flat, np.full_like(flat, local)], axis=1).astype(np.int32)
