"""Overlap of visible surfaces: vertices inside other surfaces, or inside other parts of their own surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.simulation.bodies.skin_parts import SkinParts

__all__ = ["Overlap", "SurfacePart", "overlap_of", "self_overlaps"]

_FACING = 0.3
"""Largest cosine between the normals of two surfaces in contact, which face each other."""


class SurfacePart(NamedTuple):
    """A surface by name, or a part of it, as a digit of a hand's skin."""

    surface: str
    part: str = ""

    @property
    def text(self) -> str:
        """``BALL``, ``LEFT index``."""
        return f"{self.surface} {self.part}" if self.part else self.surface


@dataclass(frozen=True, eq=False)
class Overlap:
    """Vertices inside another surface, and the vectors to its closest points [m], shape (n, 3)."""

    vertices: NDArray[np.integer]
    exit: NDArray[np.float64]

    @property
    def depth(self) -> float:
        """Depth of the deepest vertex [m]."""
        return float(np.linalg.norm(self.exit, axis=1).max(initial=0.0))

    def of(self, mask: NDArray[np.bool_]) -> Overlap:
        """The overlap restricted to masked vertices of the surface, shape (V,)."""
        chosen = mask[self.vertices]
        return Overlap(self.vertices[chosen], self.exit[chosen])


def overlap_of(
    at: NDArray[np.float64], normals: NDArray[np.float64], tested: NDArray[np.integer], found: ClosestPoints
) -> tuple[Overlap, NDArray[np.bool_]]:
    """Overlap from a closest-point projection: vertices inside whose normals face the other surface.

    Args:
        at: Positions of all vertices [m], shape (V, 3).
        normals: Their normals, shape (V, 3).
        tested: Indices of the projected vertices, shape (n,).
        found: Their projections.

    Returns:
        The overlap, and the mask of the overlapping vertices among ``tested``, shape (n,).
    """
    facing = np.einsum("vi,vi->v", normals[tested], found.normal) < _FACING
    chosen = (found.distance < 0.0) & facing
    return Overlap(tested[chosen], found.closest[chosen] - at[tested[chosen]]), chosen


def self_overlaps(
    parts: SkinParts, at: NDArray[np.float64], normals: NDArray[np.float64]
) -> Mapping[tuple[str, str], Overlap]:
    """Overlaps between the parts of a skin with vertices (V, 3) [m], by the names of the two parts."""
    boxes = [(at[part.vertices].min(axis=0), at[part.vertices].max(axis=0)) for part in parts.parts]
    out: dict[tuple[str, str], Overlap] = {}
    for other, (low, high) in zip(parts.parts, boxes, strict=True):
        surface: Facets | None = None
        for one in parts.parts:
            if one is other:
                continue
            x = at[one.vertices]
            tested = one.vertices[((x >= low) & (x <= high)).all(axis=1)]
            if not len(tested):
                continue
            surface = surface or other.surface(at)
            found, place = surface.locate(at[tested])
            inside, chosen = overlap_of(at, normals, tested, found)
            corner = surface.faces[place.face[chosen]]
            met = np.ones(len(corner), dtype=bool)
            for k in range(3):
                met &= parts.meet(inside.vertices, corner[:, k])
            if met.any():
                out[one.name, other.name] = Overlap(inside.vertices[met], inside.exit[met])
    return out
