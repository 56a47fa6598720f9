"""Comparison of calibrated coverings with the original, pose by pose: volume, folds and roughness of the surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.dihedral import dihedral_angles, hinges
from warpjld.covering.intersections import crossing_faces, other_pairs, surface_parts
from warpjld.covering.pose_losses import PoseLosses
from warpjld.covering.quality import edge_stretch, unique_edges
from warpjld.covering.tolerances import TOLERANCES, Tolerances
from warpjld.covering.volume_form import ClosedSurface, any_of
from warpjld.skeleton.kinematics import Poses

__all__ = ["Guard", "PoseMeasures", "copy_of"]

_SHARP = np.radians(70.0)  # growth of a dihedral angle above which self-intersections are searched for
_RINGS = 3  # rings of faces around such hinges that are searched
_PLATES = 0.02  # share of faces that intersect others at rest, above which a surface counts as made of plates
_BLOCK = 16  # poses deformed at once
_FACES_SEARCHED = 1_000_000  # limit of faces searched for intersections, over all poses


@dataclass(frozen=True, eq=False)
class PoseMeasures:
    """Quality measures of the deformed surface in F poses.

    Attributes:
        volume: Relative change of the volume of the flesh, shape (F,).
        roughness: RMS growth of dihedral angles beyond rest [rad], shape (F,).
        least, largest: Smallest and largest edge stretch (length over rest length) where amplitudes move the surface,
            shape (F,).
        folds: Number of faces that intersect others of the same or of an adjacent part, and did not at rest, shape
            (F,). They are searched for near sharp bends only, and in the first poses only (``_FACES_SEARCHED``).
        contacts: Number of faces that intersect those of other parts, likewise.
        folded: Vertices of the faces in ``folds``, one array a pose.
        sharper: Squared growth of the dihedral angles that amplitudes change [rad²], one array a pose.
    """

    volume: NDArray[np.float64]
    roughness: NDArray[np.float64]
    least: NDArray[np.float64]
    largest: NDArray[np.float64]
    folds: NDArray[np.int64]
    contacts: NDArray[np.int64]
    folded: list[NDArray[np.int64]]
    sharper: list[NDArray[np.float64]]

    @staticmethod
    def of_none(poses: int) -> PoseMeasures:
        """Zeros for poses that are not measured yet."""
        volume, roughness, least, largest = np.zeros((4, poses))
        folds, contacts = np.zeros((2, poses), dtype=np.int64)
        folded, sharper = [np.zeros(0, dtype=np.int64)] * poses, [np.zeros(0)] * poses
        return PoseMeasures(volume, roughness, least, largest, folds, contacts, folded, sharper)

    def summary(self) -> dict[str, float | int]:
        """Over all poses: RMS and worst volume error [%], RMS and worst roughness [degrees], extreme stretches, and
        total numbers of faces."""
        worst = int(np.abs(self.volume).argmax())
        return {
            "volume_rms": 100.0 * float(np.sqrt((self.volume**2).mean())),
            "volume_worst": 100.0 * float(self.volume[worst]),
            "roughness_rms": float(np.degrees(np.sqrt((self.roughness**2).mean()))),
            "roughness_worst": float(np.degrees(self.roughness.max())),
            "stretch_least": float(self.least.min()),
            "stretch_largest": float(self.largest.max()),
            "faces_folded": int(self.folds.sum()),
            "faces_in_contact": int(self.contacts.sum()),
        }


class Guard:
    """Measures coverings of one surface in the same poses, and compares them with the first.

    Args:
        covering: The reference; others differ from it in amplitudes only.
        poses: F poses.
        losses: Losses of these poses; they give the vertices that amplitudes move in each, to which searches are
            restricted.
        tolerances: By how much a pose may be worse than with the reference.
        progress: Called with the number of poses measured, and of all.
    """

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        losses: PoseLosses,
        tolerances: Tolerances = TOLERANCES,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        surface, flesh = covering.surface, covering.flesh
        self._poses, self._moved, self._tolerances = poses, losses.moved, tolerances
        self._closed = ClosedSurface(flesh)
        self._rest, self._faces = np.asarray(surface.vertices, dtype=np.float64), flesh.faces
        self._edges, self.hinges = unique_edges(flesh.faces), hinges(flesh.faces)
        self._dihedral = dihedral_angles(self._rest, self.hinges)
        parts = surface_parts(covering)
        # the faces of the flesh are a subset of the surface's, in the same order
        is_flesh = (covering.anchors.rigid[surface.faces] < 0).any(axis=1)
        self._parts = parts.of_face[is_flesh]
        self._joined = _joined(parts.names, covering.skeleton.names, covering.skeleton.parents)
        crossing = crossing_faces(self._rest, flesh.faces)
        self._crossing = crossing.pairs
        self._plates = len(crossing.faces) > _PLATES * len(flesh.faces)
        self._relative = self._closed.volume / losses.regions
        self._searched = np.cumsum([2 * len(points) for points in losses.moved]) <= _FACES_SEARCHED
        self._still = losses.still
        self.first = PoseMeasures.of_none(len(poses))
        self.measure(covering, np.arange(len(poses)), self.first, progress)

    def measure(
        self,
        covering: Covering,
        which: NDArray[np.int64],
        into: PoseMeasures,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        """Measure some poses of a covering.

        Args:
            covering: The covering.
            which: Indices of the poses.
            into: Its entries of these poses are overwritten.
            progress: Called with the number of poses measured, and of all.
        """
        for done, f in enumerate(which.tolist()):
            if done % _BLOCK == 0:
                chunk = which[done : done + _BLOCK]
                p = self._poses
                block = covering.deform(Poses(p.positions[chunk], p.rotations[chunk], p.flexion[chunk]))
            self._measure(block[done % _BLOCK].astype(np.float64), f, into)
            if progress:
                progress(done + 1, len(which))

    def _measure(self, points: NDArray[np.float64], f: int, into: PoseMeasures) -> None:
        """Write the measures of a deformed surface (V, 3) into ``into`` at pose ``f``."""
        inside = np.zeros(len(points), dtype=bool)
        inside[self._moved[f]] = True
        local = any_of(inside, self.hinges)
        growth = self._growth(points, local)
        into.sharper[f] = growth**2
        into.volume[f] = self._closed.volume_of(points) / self._closed.volume - 1.0
        into.roughness[f] = np.sqrt((self._still[f] + into.sharper[f].sum()) / max(len(self.hinges), 1))
        edges = self._edges[any_of(inside, self._edges)]
        stretch = edge_stretch(self._rest, points, edges) if len(edges) else np.ones(1)
        into.least[f], into.largest[f] = stretch.min(), stretch.max()
        into.folds[f], into.contacts[f], into.folded[f] = 0, 0, np.zeros(0, dtype=np.int64)
        sharp = self.hinges[local][growth > _SHARP]
        if self._searched[f] and (len(sharp) or self._plates):
            self._search(points, self._near(inside, sharp), f, into)

    def local_hinges(self, pose: int) -> NDArray[np.int64]:
        """The hinges whose angles ``PoseMeasures.sharper`` has for a pose, shape (H, 4)."""
        inside = np.zeros(len(self._rest), dtype=bool)
        inside[self._moved[pose]] = True
        return self.hinges[any_of(inside, self.hinges)]

    def _growth(self, points: NDArray[np.float64], which: NDArray[np.bool_]) -> NDArray[np.float64]:
        return np.maximum(dihedral_angles(points, self.hinges[which]) - self._dihedral[which], 0.0)

    def worse(self, measured: PoseMeasures) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
        """Which poses lost volume, have more folds, and are rougher than with the reference, shape (F,) each."""
        t, first = self._tolerances, self.first
        error, before = np.abs(measured.volume), np.abs(first.volume)
        emptier = error > np.maximum(before + t.volume, t.volume_free)
        emptier |= error * self._relative > np.maximum(before * self._relative + t.region, t.region_free)
        folded = measured.folds > t.folds * first.folds + t.folds_more
        rougher = measured.roughness > t.roughness * first.roughness + t.roughness_more
        return emptier, folded, rougher

    def _near(self, inside: NDArray[np.bool_], sharp: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Mask of the vertices near hinges that have become sharp, shape (V,). On a surface of separate plates all
        vertices that move: plates intersect without bending."""
        if self._plates:
            return inside
        near = np.zeros(len(inside), dtype=bool)
        near[sharp] = True
        for _ in range(_RINGS):
            near[self._faces[any_of(near, self._faces)]] = True
        return near

    def _search(self, points: NDArray[np.float64], near: NDArray[np.bool_], f: int, into: PoseMeasures) -> None:
        """Count intersections of the faces at the vertices of a mask, and write them into ``into`` at pose ``f``."""
        faces = np.flatnonzero(any_of(near, self._faces))
        pairs = faces[crossing_faces(points, self._faces[faces]).pairs].reshape(-1, 2)
        pairs = other_pairs(pairs, self._crossing, len(self._faces))
        a, b = self._parts[pairs].T
        folds = self._joined[a, b]
        folded = np.unique(pairs[folds])
        into.folds[f], into.contacts[f] = len(folded), len(np.unique(pairs[~folds]))
        into.folded[f] = np.unique(self._faces[folded])


def copy_of(measures: PoseMeasures) -> PoseMeasures:
    """A deep copy, whose entries can be overwritten pose by pose."""
    return replace(measures, **{name: value.copy() for name, value in vars(measures).items()})


def _joined(parts: tuple[str, ...], names: tuple[str, ...], parents: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether two parts are the same or adjacent (parent and child in the skeleton), shape (parts, parts)."""
    number = [names.index(p) if p in names else -1 for p in parts]
    out = np.eye(len(parts), dtype=bool)
    for i, a in enumerate(number):
        for j, b in enumerate(number):
            if a >= 0 and b >= 0:
                out[i, j] |= parents[a] == b or parents[b] == a
    return out
