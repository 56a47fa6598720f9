"""The parts of a surface that may meet: one patch a segment, and how thick the flesh is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["Patches", "neighbours", "patches_of", "segment_distance"]

_RING = 2  # rings of faces next to a border over which a patch comes to count in full


@dataclass(frozen=True, eq=False)
class Patches:
    """A surface cut into parts.

    Attributes:
        faces: Triangles of the whole, shape (T, 3).
        part: Part of every vertex, shape (V,).
        names: Names of the parts.
        inner: 0 at the border of a vertex's part, 1 from two rings of faces on, shape (V,).
        thickness: Distance to the bone [m], shape (V,).
        give: Compliance of every vertex, a number without unit: of two that meet each gives way by its share.
    """

    faces: NDArray[np.int32]
    part: NDArray[np.int32]
    names: tuple[str, ...]
    inner: NDArray[np.float64]
    thickness: NDArray[np.float64]
    give: NDArray[np.float64]

    def faces_of(self, part: int) -> NDArray[np.int32]:
        """Faces with two corners or more in a part."""
        return self.faces[(self.part[self.faces] == part).sum(axis=1) >= 2]


def patches(
    faces: NDArray[np.int32],
    part: NDArray[np.int32],
    names: tuple[str, ...],
    thickness: NDArray[np.float64],
    give: NDArray[np.float64] | None = None,
) -> Patches:
    """Patches of given parts; what a vertex counts for follows from its rings to the border."""
    linked = neighbours(faces, len(part))
    border = np.zeros(len(part), dtype=bool)
    corner = part[faces]
    mixed = (corner != corner[:, :1]).any(axis=1)
    border[faces[mixed].ravel()] = True
    inner = np.ones(len(part))
    reached = border
    inner[reached] = 0.0
    for ring in range(1, _RING):
        reached = reached | (linked @ reached.astype(float) > 0)
        inner[reached & (inner == 1.0)] = ring / _RING
    return Patches(faces, part, names, inner, thickness, np.ones(len(part)) if give is None else give)


def patches_of(covering: Covering) -> Patches:
    """A covering's patches: every vertex belongs to the operator that holds most of it."""
    part = covering.domains.argmax(axis=1).astype(np.int32)
    skeleton = covering.skeleton
    return patches(
        covering.surface.faces,
        part,
        tuple(fan.name for fan in covering.fans),
        segment_distance(covering.surface.vertices, skeleton.rest, [(s.proximal, s.distal) for s in skeleton.segments]),
    )


def segment_distance(
    points: NDArray[np.float64], joints: NDArray[np.float64], segments: list[tuple[int, int]]
) -> NDArray[np.float64]:
    """Distance of points (V, 3) to the nearest of the segments [m], shape (V,)."""
    best = np.full(len(points), np.inf)
    for a, b in segments:
        along = joints[b] - joints[a]
        square = max(float(along @ along), 1e-18)
        t = np.clip((points - joints[a]) @ along / square, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - joints[a] - t[:, None] * along, axis=1))
    return best


def neighbours(faces: NDArray[np.int32], count: int) -> csr_array:
    """Which vertices an edge joins, 1 each way, shape (V, V)."""
    i = faces[:, [0, 1, 2, 1, 2, 0]].ravel()
    j = faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    out = csr_array((np.ones(len(i)), (i, j)), shape=(count, count))
    out.data[:] = 1.0
    return out
