"""Loss that calibration minimises, pose by pose: volume error, edge stretch, and growth of dihedral angles.

Each term is summed over the part of the surface that amplitudes move in a pose, and divided by its size: a finger of a
body counts as much as one of a hand, and refining a mesh changes little. Constraints keep the roughness and the volume
error of each pose from growing beyond those at the start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.amplitudes import Frame
from warpjld.covering.constrained_least_squares import Linearised
from warpjld.covering.dihedral import dihedral_angles, dihedral_slopes, hinges
from warpjld.covering.quality import unique_edges
from warpjld.covering.tolerances import TOLERANCES, Tolerances
from warpjld.covering.volume_form import ClosedSurface, VolumeForm, any_of
from warpjld.geometry.surface import Surface

__all__ = ["LossTerms", "LossWeights", "PoseLoss", "SurfaceLoss"]

_STRETCHED = 0.5  # logarithm of stretch beyond which its term grows with the fourth power
_SHARP = 1.0  # growth of a dihedral angle [rad] beyond which its term does (creases and folds)
_SHORTEST = 1e-3  # lower bound of stretch in the logarithm
_THINNEST = 0.05  # share of a face's height at rest below which derivatives of dihedral angles grow no further
_SLENDER = 60.0  # largest stiffness of a hinge, for faces of hardly any height
_AIM = 0.9  # share of the tolerated growth of roughness that the constraint allows
_SAMPLE = 6000
"""About the largest number of edges, and of hinges, evaluated in a pose. More are sampled at random, the most stretched
or sharpest with the highest probability."""


@dataclass(frozen=True)
class LossWeights:
    """Weights of the terms of the loss.

    Attributes:
        volume: Weight of the squared volume error, relative to the volume that is moved.
        stretch: Weight of the mean squared logarithm of edge stretch.
        roughness: Weight of the squared growth of dihedral angles [rad²] times edge length over the height of the
            adjacent faces: the bending energy of a discrete shell (Grinspun et al. 2003), per joint that bends.
    """

    volume: float = 200.0
    stretch: float = 1.0
    roughness: float = 0.01


@dataclass(frozen=True)
class LossTerms:
    """Weighted terms of the loss of one pose."""

    volume: float
    stretch: float
    roughness: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.volume + self.stretch + self.roughness


class SurfaceLoss:
    """Quantities of the rest surface that the losses of all poses share.

    Args:
        surface: The rest surface.
        axis: Foot point of each vertex on the skeleton at rest [m], shape (V, 3); the volume between the two is
            attributed to the vertex.
        weights: Weights of the terms.
        tolerances: By how much a pose may be worse than at the start.
    """

    def __init__(
        self,
        surface: Surface,
        axis: NDArray[np.float64],
        weights: LossWeights | None = None,
        tolerances: Tolerances = TOLERANCES,
    ) -> None:
        self.weights, self.tolerances = weights or LossWeights(), tolerances
        rest = np.asarray(surface.vertices, dtype=np.float64)
        self.closed = ClosedSurface(surface)
        edges = unique_edges(surface.faces)
        length = _lengths(rest, edges)
        solid = length > 1e-9 * length.max()
        self.edges, self.length = edges[solid], length[solid]
        self.hinges = hinges(surface.faces)
        self.dihedral = dihedral_angles(rest, self.hinges)
        self.stiffness, self.least = _stiffness(rest, self.hinges)
        self.behind = _volume_behind(rest, surface.faces, axis)

    def still(self, frame: Frame) -> float:
        """Sum of the squared growth of the dihedral angles that amplitudes do not change [rad²]."""
        moved = np.zeros(len(frame.points), dtype=bool)
        moved[frame.moved] = True
        which = ~any_of(moved, self.hinges)
        growth = dihedral_angles(frame.points.astype(np.float64), self.hinges[which]) - self.dihedral[which]
        return float((np.maximum(growth, 0.0) ** 2).sum())

    def region(self, frame: Frame) -> float:
        """Volume between the skeleton and the vertices that amplitudes move in a pose [m³]."""
        return float(max(self.behind[frame.moved].sum(), 1e-9 * abs(self.closed.volume)))

    def pose(
        self, frame: Frame, start: NDArray[np.float64], still: float, *, only_held: bool = False
    ) -> PoseLoss | None:
        """The loss of a pose as a function of amplitudes; None where they do not move any vertex.

        Args:
            frame: The pose.
            start: Amplitudes of ``frame.points``, shape (P,).
            still: Result of :meth:`still` [rad²].
            only_held: Whether the pose has constraints only, and no terms of the loss.
        """
        return PoseLoss(self, frame, start, still, only_held) if len(frame.moved) else None


class PoseLoss:
    """The loss of one pose, over the edges and hinges that amplitudes move; made by ``SurfaceLoss.pose``.

    Attributes:
        parameters: Indices of the amplitudes that move any vertex, shape (p,).
        before: The terms at the start.
    """

    def __init__(
        self, shared: SurfaceLoss, frame: Frame, start: NDArray[np.float64], still: float, only_held: bool
    ) -> None:
        w, may = shared.weights, shared.tolerances
        self._only_held = only_held
        self.parameters = np.unique(frame.directions.indices)
        directions = frame.directions.tocsc()[:, self.parameters].tocsr()
        self._start = start[self.parameters]
        points = frame.points.astype(np.float64)
        moved = np.zeros(len(points), dtype=bool)
        moved[frame.moved] = True

        self._volume = VolumeForm.of(shared.closed, points, frame.moved, directions)
        self._region = region = shared.region(frame)
        self._of_volume = np.sqrt(w.volume) / region
        free = min(may.volume_free * shared.closed.volume, may.region_free * region)
        self._volume_kept = max(abs(self._volume.constant), free)

        edge = np.flatnonzero(any_of(moved, shared.edges))
        log = np.log(_lengths(points, shared.edges[edge]) / shared.length[edge])
        edge, times = _sampled(edge, shared.length[edge] * _steeper(log, _STRETCHED)[0] ** 2)
        self._length = shared.length[edge]
        self._of_stretch = np.sqrt(w.stretch * times * self._length / (times * self._length).sum())

        hinge = np.flatnonzero(any_of(moved, shared.hinges))
        grown = np.maximum(dihedral_angles(points, shared.hinges[hinge]) - shared.dihedral[hinge], 0.0)
        hinge, self._times = _sampled(hinge, grown**2)
        self._dihedral, self._least = shared.dihedral[hinge], shared.least[hinge]
        bent = max(float(frame.ratio.sum()), 1.0)
        self._of_roughness = np.sqrt(w.roughness * self._times * shared.stiffness[hinge] / bent)

        edges, hinged = shared.edges[edge], shared.hinges[hinge]
        used = np.unique(np.concatenate([edges.ravel(), hinged.ravel()]))
        number = np.full(len(points), -1)
        number[used] = np.arange(len(used))
        self._edges, self._hinges, self._points = number[edges], number[hinged], points[used]
        self._directions = _dense(directions, number[frame.moved], len(used))

        # stricter than the tolerance, since only a sample of the hinges is evaluated here
        growth = 1.0 + _AIM * (may.roughness - 1.0)
        rough = float((self._times * self._growth(self._points) ** 2).sum())
        count = max(len(shared.hinges), 1)
        most = growth * np.sqrt((rough + still) / count) + _AIM * may.roughness_more
        self._rough_kept = count * float(most) ** 2 - still
        self.before = self._terms(self._points, self._volume.constant)

    def terms(self, amplitudes: NDArray[np.float64]) -> LossTerms:
        """Terms of the loss at all amplitudes, shape (P,)."""
        change = amplitudes[self.parameters] - self._start
        return self._terms(self._at(change), self._volume.lost(change)[0])

    def _terms(self, points: NDArray[np.float64], lost: float) -> LossTerms:
        """Terms at positions of the sampled vertices and a volume error [m³]."""
        log, growth = self._logarithms(points)[0], self._growth(points)
        return LossTerms(
            float((self._of_volume * lost) ** 2),
            float(((self._of_stretch * _steeper(log, _STRETCHED)[0]) ** 2).sum()),
            float(((self._of_roughness * _steeper(growth, _SHARP)[0]) ** 2).sum()),
        )

    def linearised(self, amplitudes: NDArray[np.float64]) -> Linearised:
        """Residuals, whose squares sum to the loss, and constraints at all amplitudes, shape (P,): squared roughness
        relative to its limit, and volume error relative to the volume that is moved."""
        change = amplitudes[self.parameters] - self._start
        points = self._at(change)
        lost, by_lost = self._volume.lost(change)
        growth = self._growth(points)
        grows = np.flatnonzero(growth > 0.0)
        by_angle = self._by_amplitude(
            self._hinges[grows], dihedral_slopes(points, self._hinges[grows], self._least[grows])
        )
        rough = float((self._times * growth**2).sum()) / self._rough_kept
        by_rough = 2.0 / self._rough_kept * ((self._times * growth)[grows] @ by_angle)
        kept = self._volume_kept
        constraints = np.array([rough - 1.0, (lost - kept) / self._region, (-lost - kept) / self._region])
        slopes = np.stack([by_rough, by_lost / self._region, -by_lost / self._region])
        if self._only_held:
            return Linearised(np.zeros(0), np.zeros((0, len(change))), constraints, slopes)

        log, along, squared = self._logarithms(points)
        stretch, slope = _steeper(log, _STRETCHED)
        pull = (self._of_stretch * slope / squared)[:, None] * along
        by_stretch = self._by_amplitude(self._edges, np.stack([-pull, pull], axis=1))
        sharp, slope = _steeper(growth[grows], _SHARP)
        of_sharp = self._of_roughness[grows]
        residuals = [[self._of_volume * lost], self._of_stretch * stretch, of_sharp * sharp]
        by_amplitude = [self._of_volume * by_lost[None], by_stretch, (of_sharp * slope)[:, None] * by_angle]
        return Linearised(np.concatenate(residuals), np.concatenate(by_amplitude), constraints, slopes)

    def volume_slope(self, amplitudes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivative of the volume by ``parameters`` [m³], shape (p,)."""
        return self._volume.lost(amplitudes[self.parameters] - self._start)[1]

    def _at(self, change: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._points + self._directions @ change)

    def _by_amplitude(self, corners: NDArray[np.int64], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of N numbers by amplitudes, shape (N, p).

        Args:
            corners: Points that each number depends on, shape (N, k).
            slopes: Derivatives by their positions, shape (N, k, 3).
        """
        count, width = len(corners), 3 * corners.shape[1]
        column = (3 * corners[:, :, None] + np.arange(3)).ravel()
        directions = self._directions.reshape(-1, len(self.parameters))
        shape = (count, len(directions))
        rows = sp.csr_array((slopes.ravel(), column, np.arange(count + 1) * width), shape=shape)
        return np.asarray(rows @ directions)

    def _logarithms(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        along = points[self._edges[:, 1]] - points[self._edges[:, 0]]
        squared = np.maximum(np.einsum("ij,ij->i", along, along), (_SHORTEST * self._length) ** 2)
        return 0.5 * np.log(squared) - np.log(self._length), along, squared

    def _growth(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.maximum(dihedral_angles(points, self._hinges) - self._dihedral, 0.0)


def _dense(directions: sp.csr_array, number: NDArray[np.int64], count: int) -> NDArray[np.float64]:
    """Derivatives (3 n, p), rows x, y, z of n vertices, as a dense array (count, 3, p).

    Args:
        directions: The derivatives.
        number: Row of each vertex in the result, -1 for those left out, shape (n,).
        count: Number of rows.
    """
    out = np.zeros((count, 3, directions.shape[1]))
    entries = directions.tocoo()
    row, axis = np.divmod(entries.coords[0], 3)
    kept = number[row] >= 0
    out[number[row[kept]], axis[kept], entries.coords[1][kept]] = entries.data[kept]
    return out


def _sampled(chosen: NDArray[np.int64], weight: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """About ``_SAMPLE`` of the chosen elements at most, drawn with probabilities that grow with their weight, and the
    inverse of each one's probability, by which it counts."""
    if len(chosen) <= _SAMPLE:
        return chosen, np.ones(len(chosen))
    likely = weight / max(float(weight.sum()), 1e-30) + 1.0 / len(chosen)
    chance = np.minimum(0.5 * _SAMPLE * likely, 1.0)
    kept = np.flatnonzero(np.random.default_rng(0).uniform(size=len(chosen)) < chance)
    return chosen[kept], 1.0 / chance[kept]


def _steeper(x: NDArray[np.float64], beyond: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x √(1 + (x / beyond)²) and its derivative: its square grows as x² for small x and as x⁴ for large ones."""
    ratio = (x / beyond) ** 2
    root = np.sqrt(1.0 + ratio)
    return x * root, (1.0 + 2.0 * ratio) / root


def _lengths(points: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float64]:
    along = points[edges[:, 1]] - points[edges[:, 0]]
    return np.asarray(np.maximum(np.sqrt(np.einsum("ij,ij->i", along, along)), 1e-30))


def _volume_behind(
    rest: NDArray[np.float64], faces: NDArray[np.int32], axis: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Volume between each vertex's share of the surface and its foot point on the skeleton [m³], shape (V,)."""
    a, b, c = (rest[faces[:, k]] for k in range(3))
    height = (a + b + c - axis[faces].sum(axis=1)) / 3.0
    third = (height * np.cross(b - a, c - a)).sum(axis=1) / 18.0
    out = sum(np.bincount(faces[:, k], third, minlength=len(rest)) for k in range(3))
    return np.maximum(out, 0.0)


def _stiffness(rest: NDArray[np.float64], hinge: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bending stiffness of each hinge, shape (H,): edge length over a third of the mean height of its two faces. And
    lower bounds of these faces' doubled areas as divisors in derivatives [m²], shape (H, 2)."""
    i, j, k, m = (rest[hinge[:, n]] for n in range(4))
    along = np.linalg.norm(j - i, axis=1)
    areas = np.stack([np.linalg.norm(np.cross(j - i, other - i), axis=1) for other in (k, m)], axis=1)
    height = areas.sum(axis=1) / np.maximum(2.0 * along, 1e-30)
    solid = height > 1e-3 * along
    stiffness = np.where(solid, 3.0 * along / np.where(solid, height, 1.0), 0.0)
    return np.minimum(stiffness, _SLENDER), np.maximum(_THINNEST * areas, 1e-12 * along[:, None] ** 2)
