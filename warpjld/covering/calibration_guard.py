"""Whether one covering is worse than another in any pose: volume, folds and roughness, measured on what it deforms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.dihedral import dihedral_angles, hinges
from warpjld.covering.intersections import Crossings, crossing_faces, surface_parts
from warpjld.covering.quality import edge_stretch, unique_edges
from warpjld.covering.volume_form import ClosedSurface
from warpjld.skeleton.kinematics import Poses

__all__ = ["Guard", "PoseMeasures", "TOLERANCES", "Tolerances"]

_SHARP = np.radians(60.0)  # faces cross where the skin has been bent; poses that bend none so far are not searched
_FACES_CHECKED = 1_000_000  # faces searched for crossings, all poses together


@dataclass(frozen=True)
class Tolerances:
    """What a pose may differ by and still not be worse.

    Attributes:
        volume: Growth of the volume error, of the whole; and
        volume_free: error of the whole, and
        region_free: of what the pose moves, below which it may grow at will: all three have to be passed.
        folds: Faces that fold, as a factor and
        folds_more: as a number.
        roughness: As a factor, and
        roughness_more: RMS of dihedral angles [rad].
    """

    volume: float = 0.001
    volume_free: float = 0.009
    region_free: float = 0.05
    folds: float = 1.02
    folds_more: float = 2.0
    roughness: float = 1.03
    roughness_more: float = float(np.radians(0.05))


TOLERANCES = Tolerances()


@dataclass(frozen=True, eq=False)
class PoseMeasures:
    """Measures of F poses.

    Attributes:
        volume: Relative change of the volume of the flesh, shape (F,).
        folds: Faces that cross others of the same part or of one that it joins on to, more than at rest, shape (F,).
        contacts: Faces that cross those of another part, likewise.
        roughness: RMS growth of dihedral angles beyond rest [rad], shape (F,).
        least, largest: Edge stretch, shape (F,).
    """

    volume: NDArray[np.float64]
    folds: NDArray[np.int64]
    contacts: NDArray[np.int64]
    roughness: NDArray[np.float64]
    least: NDArray[np.float64]
    largest: NDArray[np.float64]


class Guard:
    """Measures coverings of one surface in the same poses, and compares them to the first.

    Args:
        covering: What others are compared to.
        poses: F poses.
        moved: Vertices that amplitudes move in each pose: folds are looked for among them.
        region: Volume that each pose moves [m³], shape (F,).
        tolerances: What counts as worse.
    """

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        moved: list[NDArray[np.int64]],
        region: NDArray[np.float64],
        tolerances: Tolerances = TOLERANCES,
    ) -> None:
        surface, flesh = covering.surface, covering.flesh
        self._poses, self._moved, self._tolerances = poses, moved, tolerances
        self._closed = ClosedSurface(flesh)
        self._rest, self._faces = np.asarray(surface.vertices, dtype=np.float64), flesh.faces
        self._edges, self._hinges = unique_edges(flesh.faces), hinges(flesh.faces)
        self._dihedral = dihedral_angles(self._rest, self._hinges)
        owner = {tuple(f): n for n, f in enumerate(surface.faces.tolist())}
        parts = surface_parts(covering)
        self._parts = parts.of_face[[owner[tuple(f)] for f in flesh.faces.tolist()]]
        self._joined = _joined(parts.names, covering.skeleton.names, covering.skeleton.parents)
        self._crossing = _keys(crossing_faces(self._rest, flesh.faces), len(flesh.faces))
        self._relative = self._closed.volume / region
        self._searched = np.zeros(len(poses), dtype=bool)
        self.first: PoseMeasures
        self.first = self.measure(covering)

    def measure(self, covering: Covering, progress: Callable[[int, int], None] | None = None) -> PoseMeasures:
        """Of another covering of the surface."""
        count = len(self._poses)
        out = PoseMeasures(
            *(np.zeros(count, dtype=kind) for kind in (float, np.int64, np.int64, float, float, float))
        )
        left = _FACES_CHECKED
        for start, block in covering.blocks(self._poses):
            for k, surface in enumerate(block):
                f, points = start + k, surface.astype(np.float64)
                out.volume[f] = self._closed.volume_of(points) / self._closed.volume - 1.0
                stretch = edge_stretch(self._rest, points, self._edges)
                out.least[f], out.largest[f] = stretch.min(), stretch.max()
                growth = np.maximum(dihedral_angles(points, self._hinges) - self._dihedral, 0.0)
                out.roughness[f] = np.sqrt((growth**2).mean())
                if growth.max(initial=0.0) > _SHARP and left > 0:
                    out.folds[f], out.contacts[f], searched = self._crossings(points, self._moved[f])
                    left -= searched
                if progress:
                    progress(f + 1, count)
        return out

    def worse(self, measured: PoseMeasures) -> NDArray[np.bool_]:
        """Poses that are worse than at first, shape (F,)."""
        t, first = self._tolerances, self.first
        error, before = np.abs(measured.volume), np.abs(first.volume)
        more = error - before
        emptier = (more > 0.0) & (more > t.volume) & (error > t.volume_free)
        emptier |= (more * self._relative > 0.01) & (error * self._relative > t.region_free)
        folded = measured.folds > t.folds * first.folds + t.folds_more
        rougher = measured.roughness > t.roughness * first.roughness + t.roughness_more
        import os
        if os.environ.get("GUARD"):
            for f in np.flatnonzero(emptier | folded | rougher):
                print("worse", f, "EMPTY" if emptier[f] else "", "FOLD" if folded[f] else "", "ROUGH" if rougher[f] else "", first.volume[f].round(4), measured.volume[f].round(4), self._relative[f].round(1), first.folds[f], measured.folds[f], np.degrees(first.roughness[f]).round(3), np.degrees(measured.roughness[f]).round(3))
        return np.asarray(emptier | folded | rougher)

    def _crossings(self, points: NDArray[np.float64], moved: NDArray[np.int64]) -> tuple[int, int, int]:
        """Faces that fold, faces in contact, and faces searched."""
        inside = np.zeros(len(points), dtype=bool)
        inside[moved] = True
        faces = np.flatnonzero(inside[self._faces].any(axis=1))
        pairs = faces[crossing_faces(points, self._faces[faces]).pairs].reshape(-1, 2)
        pairs = pairs[~np.isin(pairs[:, 0] * len(self._faces) + pairs[:, 1], self._crossing)]
        a, b = self._parts[pairs].T
        folds = self._joined[a, b]
        return len(np.unique(pairs[folds])), len(np.unique(pairs[~folds])), len(faces)


def _keys(crossings: Crossings, faces: int) -> NDArray[np.int64]:
    pairs = crossings.pairs.astype(np.int64)
    return pairs[:, 0] * faces + pairs[:, 1]


def _joined(parts: tuple[str, ...], names: tuple[str, ...], parents: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether two parts are the same one or limbs that join on to each other, shape (parts, parts)."""
    number = [names.index(p) if p in names else -1 for p in parts]
    out = np.eye(len(parts), dtype=bool)
    for i, a in enumerate(number):
        for j, b in enumerate(number):
            if a >= 0 and b >= 0:
                out[i, j] |= parents[a] == b or parents[b] == a
    return out
