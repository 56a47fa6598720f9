"""Structured boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.mesh.hexmesh import HexMesh, elements_of

__all__ = ["box_hexes"]


def box_hexes(
    size: ArrayLike = (1.0, 1.0, 1.0),
    counts: tuple[int, int, int] = (8, 8, 8),
    *,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    name: str = "body",
) -> HexMesh:
    """A box of ``counts`` elements, its faces named ``x-``, ``x+``, ``y-``, ``y+``, ``z-``, ``z+``.

    Args:
        size: Edge lengths [m].
        counts: Elements along x, y, z.
        origin: Lowest corner [m].
        name: Region name.

    Raises:
        InputError: A size or count that is not positive.
    """
    lengths = np.asarray(size, dtype=np.float64)
    if lengths.shape != (3,) or not (lengths > 0).all():
        raise InputError(f"size: want three positive lengths, got {lengths}")
    if len(counts) != 3 or min(counts) < 1:
        raise InputError(f"counts: want three positive numbers of elements, got {counts}")
    lines = [np.linspace(0.0, length, n + 1) for length, n in zip(lengths, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3) + np.asarray(origin, dtype=np.float64)
    grid = np.arange(len(nodes), dtype=np.int32).reshape([n + 1 for n in counts])
    elements = elements_of(grid)
    cells = np.arange(len(elements), dtype=np.int32).reshape(counts)
    faces = {}
    for axis, letter in enumerate("xyz"):
        for end, sign in ((0, "-"), (-1, "+")):
            chosen = np.take(cells, end, axis=axis).ravel()
            faces[letter + sign] = np.stack([chosen, np.full_like(chosen, 2 * axis + (end != 0))], axis=1)
    return HexMesh(nodes, elements, np.zeros(len(elements), np.int32), (name,), faces, {}, (grid,))
