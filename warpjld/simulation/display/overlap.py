"""Overlap of visible surfaces: vertices that are inside others, or inside other parts of their own."""

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
"""Surfaces that meet look at each other: cosine between their normals, at most."""


class SurfacePart(NamedTuple):
    """A surface by its name; or a part of it, as a digit of a hand's skin."""

    surface: str
    part: str = ""

    @property
    def text(self) -> str:
        """``BALL``, ``LEFT index``."""
        return f"{self.surface} {self.part}" if self.part else self.surface


@dataclass(frozen=True, eq=False)
class Overlap:
    """Vertices that are inside something, and the way out [m]."""

    vertices: NDArray[np.integer]
    way: NDArray[np.float64]

    @property
    def depth(self) -> float:
        """Of the deepest [m]."""
        return float(np.linalg.norm(self.way, axis=1).max(initial=0.0))

    def of(self, some: NDArray[np.bool_]) -> Overlap:
        """Those of some of the surface's vertices (V,)."""
        chosen = some[self.vertices]
        return Overlap(self.vertices[chosen], self.way[chosen])


def overlap_of(
    at: NDArray[np.float64], normals: NDArray[np.float64], some: NDArray[np.integer], found: ClosestPoints
) -> tuple[Overlap, NDArray[np.bool_]]:
    """Of vertices (n) for which something was found, those inside that look at what they are in; and which they are.

    Args:
        at: Where all vertices are [m], shape (V, 3).
        normals: Theirs, shape (V, 3).
        some: The vertices.
        found: Of each of them.
    """
    facing = np.einsum("vi,vi->v", normals[some], found.normal) < _FACING
    chosen = (found.distance < 0.0) & facing
    return Overlap(some[chosen], found.closest[chosen] - at[some[chosen]]), chosen


def self_overlaps(
    parts: SkinParts, at: NDArray[np.float64], normals: NDArray[np.float64]
) -> Mapping[tuple[str, str], Overlap]:
    """Vertices (V, 3) [m] of parts of a skin inside other parts: by the names of both, none where nothing overlaps."""
    boxes = [(at[part.vertices].min(axis=0), at[part.vertices].max(axis=0)) for part in parts.parts]
    out: dict[tuple[str, str], Overlap] = {}
    for other, (low, high) in zip(parts.parts, boxes, strict=True):
        surface: Facets | None = None
        for one in parts.parts:
            if one is other:
                continue
            x = at[one.vertices]
            some = one.vertices[((x >= low) & (x <= high)).all(axis=1)]
            if not len(some):
                continue
            surface = surface or other.surface(at)
            found, place = surface.locate(at[some])
            inside, chosen = overlap_of(at, normals, some, found)
            corner = surface.faces[place.face[chosen]]
            met = np.ones(len(corner), dtype=bool)
            for k in range(3):
                met &= parts.meet(inside.vertices, corner[:, k])
            if met.any():
                out[one.name, other.name] = Overlap(inside.vertices[met], inside.way[met])
    return out
