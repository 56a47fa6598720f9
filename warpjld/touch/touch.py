"""Contact of the skin with itself, displayed: what crosses is parted, and what is displaced bulges beside it.

No forces and no equilibrium: contact that is solved is PRESS (:mod:`warpjld.press`). Each sweep finds the vertices that
lie inside another part, moves both sides out along the other's normals by shares as their compliances are, smooths
that displacement over the surface on the scale of the flesh's thickness, and gives the volume back around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.touch.depths import Depths, Finder
from warpjld.touch.patches import Patches, patches_of
from warpjld.touch.smoothing import smoothing

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["SHARE", "Touch", "Touched"]

SHARE = 1.0 / 3.0
"""Of the local thickness: overlaps up to it are parted, deeper ones are poses that nobody can take."""

_SWEEPS = 4
_SOFT = 0.05  # of the depth that can be parted: over it a vertex comes to count as touching
_CLEARANCE = 0.1  # likewise: how far both sides are moved beyond their meeting
_NOISE = 1e-6  # of the surface's size
_REACH = 0.25  # of the median thickness: how far a displacement is smoothed


@dataclass(frozen=True)
class Touched:
    """The deepest overlap of one part in one frame that is too deep to be parted.

    Attributes:
        part: The part, e.g. ``left.index.knuckle2``.
        other: What it is inside of.
        frame: Frame number.
        depth: Depth [m].
    """

    part: str
    other: str
    frame: int
    depth: float


class Touch:
    """Parts what crosses on a covering's deformed surface; made once, applied to any frames.

    Args:
        patches: The surface's parts.
        vertices: Rest positions [m], shape (V, 3). What overlaps there already stays as it is, to that depth.
    """

    def __init__(self, patches: Patches, vertices: NDArray[np.float64]) -> None:
        if (patches.give < 0.0).any() or not np.isfinite(patches.give).all():
            raise InputError("touch: compliances must be finite numbers, 0 or above")
        self.patches = patches
        self.finder = Finder(patches, vertices)
        reach = _REACH * float(np.median(patches.thickness))
        self._smooth = smoothing(vertices, patches.faces, reach)
        self.limit = SHARE * patches.thickness
        self._rest = np.zeros(len(vertices))
        at_rest = self.depths(vertices).depth
        # a little more than it is: in other positions single precision makes some of it anew
        noise = _NOISE * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        self._rest = np.where(at_rest > 0.0, 1.001 * at_rest + noise, 0.0)
        self._mean_give = np.array(
            [
                patches.give[patches.part == k].mean() if (patches.part == k).any() else 1.0
                for k in range(len(patches.names))
            ]
        )

    @classmethod
    def of(cls, covering: Covering) -> Touch:
        """Of a covering's own parts, all equally compliant."""
        return cls(patches_of(covering), covering.surface.vertices)

    def depths(self, points: NDArray[np.floating]) -> Depths:
        """Overlaps of one frame (V, 3), less what overlaps at rest."""
        found = self.finder(points)
        depth = np.maximum(found.depth - self._rest, 0.0)
        return replace(found, depth=depth, other=np.where(depth > 0.0, found.other, -1))

    def apply(self, points: NDArray[np.floating], *, first: int = 0) -> tuple[NDArray[np.floating], list[Touched]]:
        """Part what crosses.

        Args:
            points: Deformed vertices [m], shape (F, V, 3).
            first: Number of the first frame, for what is told.

        Returns:
            The vertices, of the same type, bit for bit the same where nothing is near an overlap; and the overlaps
            too deep to be parted, the deepest of every part and frame.
        """
        if points.ndim != 3 or points.shape[1:] != (len(self.patches.part), 3):
            raise InputError(f"touch: want points of shape (frames, {len(self.patches.part)}, 3), got {points.shape}")
        out = points.copy()
        told: list[Touched] = []
        for k in range(len(points)):
            told += self._frame(out[k], first + k)
        return out, told

    def _frame(self, points: NDArray[np.floating], frame: int) -> list[Touched]:
        told: list[Touched] = []
        moved = points.astype(np.float64)
        before = moved.copy()
        normals = None
        for sweep in range(_SWEEPS):
            found = self.depths(moved)
            if not found.depth.any():
                break
            if sweep == 0:
                told = self._deep(found, frame)
                normals = found.normals
            moved += self._parting(found)
        if normals is None:
            return told
        shift = moved - before
        shift += self._bulge(before, shift, normals)
        at = np.abs(shift).max(axis=1) > 0.0
        points[at] = (before + shift)[at]
        return told

    def _parting(self, found: Depths) -> NDArray[np.float64]:
        """Displacement of one sweep, shape (V, 3)."""
        limit = self.limit
        # beyond the limit it falls to nothing again: continuous, and a pose nobody can take is left as it is
        depth = np.clip(np.minimum(found.depth, 2.0 * limit - found.depth), 0.0, None)
        give = self.patches.give
        other = np.where(found.other >= 0, self._mean_give[found.other], 1.0)
        share = give / np.maximum(give + other, 1e-12)
        hit = np.clip(depth / (_SOFT * limit), 0.0, 1.0)
        # a little more than met: between vertices that are just out, edges still cross
        wanted = (share * (depth + _CLEARANCE * limit * hit))[:, None] * found.way
        weight = self._smooth @ hit
        # where contact is, the mean is over contact; at its rim over what is free as well
        over = hit * weight + (1.0 - hit) * np.maximum(weight, 0.5)
        smooth = (self._smooth @ wanted) / np.maximum(over, 1e-9)[:, None]
        free = (give > 0.0)[:, None]
        return np.asarray(np.where(free, smooth, 0.0))

    def _bulge(
        self, points: NDArray[np.float64], shift: NDArray[np.float64], normals: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """What gives each part's displaced volume back, around where it was displaced, shape (V, 3)."""
        size = np.linalg.norm(shift, axis=1)
        ring = np.clip(self._smooth @ size - size, 0.0, None) * (self.patches.give > 0.0)
        faces = self.patches.faces
        a, b, c = (points[faces[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        area = sum(np.bincount(faces[:, k], area, minlength=len(points)) for k in range(3))
        count = len(self.patches.names)
        lost = -np.bincount(self.patches.part, area * (shift * normals).sum(axis=1), minlength=count)
        room = np.bincount(self.patches.part, area * ring, minlength=count)
        height = lost / np.where(room > 0.0, room, 1.0) * (room > 0.0)
        height = np.clip(height[self.patches.part] * ring, -self.limit, self.limit)
        return np.asarray(height[:, None] * normals)

    def _deep(self, found: Depths, frame: int) -> list[Touched]:
        deep = np.flatnonzero(found.depth > self.limit)
        told = {}
        for v in deep[np.argsort(found.depth[deep])].tolist():  # the deepest last, which stays
            part = self.patches.names[self.patches.part[v]]
            told[part] = Touched(part, self.patches.names[found.other[v]], frame, float(found.depth[v]))
        return list(told.values())
