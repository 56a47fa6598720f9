"""What calibration makes small, pose by pose: lost volume, stretched and squeezed edges, sharp edges that were not there.

Everything is summed up over what the amplitudes move in a pose, and in proportion to it: a finger of a body counts as
much as one of a hand, and refining a mesh changes little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.dihedral import dihedral_angles, dihedral_slopes, hinges
from warpjld.covering.quality import closing_fans, enclosed_volume, unique_edges
from warpjld.surface import Surface

__all__ = ["LossTerms", "LossWeights", "PoseLoss", "SurfaceLoss"]

_STRETCHED = 0.5  # logarithm of stretch, and
_SHARP = 1.0  # growth of a dihedral angle [rad], from which on edges weigh with the fourth power: creases and folds
_SHORTEST = 1e-3  # stretch at which the logarithm is cut off
_THINNEST = 0.05  # height of a face, of that at rest, below which dihedral angles are not followed more steeply


@dataclass(frozen=True)
class LossWeights:
    """Weights of the terms.

    Attributes:
        volume: Of the squared volume error, of the volume that is moved.
        stretch: Of the mean squared logarithm of edge stretch.
        roughness: Of the squared growth of dihedral angles [rad²], by edge length over the height of the faces beside
            it: the bending energy of a discrete shell (Grinspun et al. 2003), of each joint that bends.
    """

    volume: float = 100.0
    stretch: float = 1.0
    roughness: float = 0.01


@dataclass(frozen=True)
class LossTerms:
    """The terms of one pose, weighted."""

    volume: float
    stretch: float
    roughness: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.volume + self.stretch + self.roughness


class SurfaceLoss:
    """What the losses of all poses of a surface share.

    Args:
        surface: The rest surface.
        axis: Where each vertex hangs on the skeleton at rest [m], shape (V, 3): says which volume lies behind it.
        weights: Weights of the terms.
    """

    def __init__(
        self, surface: Surface, axis: NDArray[np.float64], weights: LossWeights | None = None
    ) -> None:
        self.weights = weights or LossWeights()
        self.rest = np.asarray(surface.vertices, dtype=np.float64)
        self.volume = float(enclosed_volume(self.rest, surface.faces))
        boundary, loop = closing_fans(surface.faces)
        count, rims = len(self.rest), int(loop.max(initial=-1)) + 1
        members = np.bincount(loop, minlength=rims)
        mean = sp.csr_array((1.0 / members[loop], (loop, boundary[:, 0])), shape=(rims, count))
        self.closed = sp.csr_array(sp.vstack([sp.eye_array(count, format="csr"), mean], format="csr"))
        fans = np.column_stack([boundary[:, ::-1], count + loop])
        self.faces = np.concatenate([surface.faces.astype(np.int64), fans])
        edges = unique_edges(surface.faces)
        length = np.linalg.norm(self.rest[edges[:, 1]] - self.rest[edges[:, 0]], axis=1)
        solid = length > 1e-9 * length.max()
        self.edges, self.length = edges[solid], length[solid]
        self.hinges = hinges(surface.faces)
        self.dihedral = dihedral_angles(self.rest, self.hinges)
        self.stiffness, self.least = _stiffness(self.rest, self.hinges)
        self.behind = _volume_behind(self.rest, surface.faces, axis)

    def pose(self, base: NDArray[np.float64], directions: sp.csr_array, bent: float) -> PoseLoss | None:
        """The loss of a pose as a function of amplitudes; None where they move nothing.

        Args:
            base: B [m], shape (V, 3), and
            directions: D, shape (3 V, P), of ``LinearDeformation.frame``.
            bent: Sum of the flexion ratios: how many joints bend.
        """
        moved = np.diff(directions.indptr).reshape(-1, 3).any(axis=1)
        return PoseLoss(self, base, directions, moved, bent) if moved.any() else None


class PoseLoss:
    """The loss of one pose, over the faces, edges and hinges that its amplitudes move; made by ``SurfaceLoss.pose``.

    Attributes:
        parameters: Amplitudes that move anything, shape (p,).
    """

    def __init__(
        self,
        shared: SurfaceLoss,
        base: NDArray[np.float64],
        directions: sp.csr_array,
        moved: NDArray[np.bool_],
        bent: float,
    ) -> None:
        self._weights = shared.weights
        self._rest_volume = shared.volume
        closed = shared.closed
        rim = (closed @ moved.astype(np.float64)) != 0.0
        faces = shared.faces[rim[shared.faces].any(axis=1)]
        edge = moved[shared.edges].any(axis=1)
        hinge = moved[shared.hinges].any(axis=1)
        edges, hinged = shared.edges[edge], shared.hinges[hinge]
        used = np.unique(np.concatenate([faces.ravel(), edges.ravel(), hinged.ravel()]))
        number = np.full(closed.shape[0], -1)
        number[used] = np.arange(len(used))
        self._faces, self._edges, self._hinges = number[faces], number[edges], number[hinged]
        everywhere = closed @ base
        origin = base[moved].mean(axis=0)
        self._base = everywhere[used] - origin
        still = shared.faces[~rim[shared.faces].any(axis=1)]
        self._still_volume = _six_volumes(everywhere - origin, still).sum() / 6.0
        self.parameters = np.unique(directions.indices)
        some = directions.tocsc()[:, self.parameters].tocsr()
        axes = [closed[used] @ some[k::3] for k in range(3)]
        rows = sp.csr_array(sp.vstack(axes, format="csr"))
        order = (np.arange(3) * len(used) + np.arange(len(used))[:, None]).ravel()
        self._directions = sp.csr_array(rows[order])
        self._length = shared.length[edge]
        self._dihedral, self._least = shared.dihedral[hinge], shared.least[hinge]
        w = self._weights
        self._region = float(shared.behind[moved].sum())
        self._of_volume = np.sqrt(w.volume) / self._region
        self._of_stretch = np.sqrt(w.stretch * self._length / self._length.sum())
        self._of_roughness = np.sqrt(w.roughness * shared.stiffness[hinge] / max(bent, 1.0))

    def terms(self, amplitudes: NDArray[np.float64]) -> LossTerms:
        """Of all amplitudes, shape (P,)."""
        points = self._points(amplitudes)
        volume, log, growth = self._volume_error(points), self._logarithms(points)[0], self._growth(points)
        return LossTerms(
            float((self._of_volume * volume) ** 2),
            float(((self._of_stretch * _steeper(log, _STRETCHED)[0]) ** 2).sum()),
            float(((self._of_roughness * _steeper(growth, _SHARP)[0]) ** 2).sum()),
        )

    def residuals(self, amplitudes: NDArray[np.float64]) -> tuple[NDArray[np.float64], sp.csr_array]:
        """Numbers whose squares sum to the loss, shape (N,), and their derivatives by ``parameters``, (N, p)."""
        points = self._points(amplitudes)
        volume = self._of_volume * self._volume_error(points)
        by_points = [sp.csr_array((self._of_volume * self._volume_slope(points)).reshape(1, -1))]
        log, along, squared = self._logarithms(points)
        value, slope = _steeper(log, _STRETCHED)
        stretch = self._of_stretch * value
        pull = (self._of_stretch * slope / squared)[:, None] * along
        by_points.append(_by_points(self._edges, np.stack([-pull, pull], axis=1), len(points)))
        growth = self._growth(points)
        value, slope = _steeper(growth, _SHARP)
        rough = self._of_roughness * value
        grows = np.flatnonzero(growth > 0.0)
        turn = dihedral_slopes(points, self._hinges[grows], self._least[grows])
        turn *= (self._of_roughness * slope)[grows, None, None]
        by_points.append(_by_points(self._hinges[grows], turn, len(points)))
        jacobian = sp.csr_array(sp.vstack(by_points, format="csr") @ self._directions)
        return np.concatenate([[volume], stretch, rough[grows]]), jacobian

    def volume(self, amplitudes: NDArray[np.float64]) -> tuple[float, float]:
        """Change of volume, relative to the whole and to what is moved."""
        error = self._volume_error(self._points(amplitudes))
        return error / self._rest_volume, error / self._region

    def _points(self, amplitudes: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._base + (self._directions @ amplitudes[self.parameters]).reshape(-1, 3)

    def _volume_error(self, points: NDArray[np.float64]) -> float:
        return float(_six_volumes(points, self._faces).sum() / 6.0 + self._still_volume - self._rest_volume)

    def _volume_slope(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        a, b, c = (points[self._faces[:, k]] for k in range(3))
        slope = np.zeros_like(points)
        for k, normal in enumerate((np.cross(b, c), np.cross(c, a), np.cross(a, b))):
            for axis in range(3):
                slope[:, axis] += np.bincount(self._faces[:, k], normal[:, axis], minlength=len(points))
        return slope / 6.0

    def _logarithms(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        along = points[self._edges[:, 1]] - points[self._edges[:, 0]]
        squared = np.maximum((along**2).sum(axis=1), (_SHORTEST * self._length) ** 2)
        return 0.5 * np.log(squared) - np.log(self._length), along, squared

    def _growth(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.maximum(dihedral_angles(points, self._hinges) - self._dihedral, 0.0)


def _steeper(x: NDArray[np.float64], beyond: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x √(1 + (x / beyond)²) and its derivative: squared, x² for small x and x⁴ for large ones."""
    ratio = (x / beyond) ** 2
    root = np.sqrt(1.0 + ratio)
    return x * root, (1.0 + 2.0 * ratio) / root


def _by_points(corners: NDArray[np.int64], slopes: NDArray[np.float64], count: int) -> sp.csr_array:
    """Rows of derivatives by the positions of their corners: (N, k) and (N, k, 3) → (N, 3 · count)."""
    rows, width = len(corners), 3 * corners.shape[1]
    column = (3 * corners[:, :, None] + np.arange(3)).reshape(rows, width)
    start = np.arange(rows + 1) * width
    return sp.csr_array((slopes.ravel(), column.ravel(), start), shape=(rows, 3 * count))


def _six_volumes(points: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.asarray((a * np.cross(b, c)).sum(axis=1))


def _volume_behind(
    rest: NDArray[np.float64], faces: NDArray[np.int32], axis: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Volume between each vertex's share of the surface and the skeleton [m³], shape (V,)."""
    a, b, c = (rest[faces[:, k]] for k in range(3))
    height = (a + b + c - axis[faces].sum(axis=1)) / 3.0
    third = (height * np.cross(b - a, c - a)).sum(axis=1) / 18.0
    out = sum(np.bincount(faces[:, k], third, minlength=len(rest)) for k in range(3))
    return np.maximum(out, 0.0)


def _stiffness(
    rest: NDArray[np.float64], hinge: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Edge length over a third of the mean height of the faces beside it, and the least doubled areas of those faces
    that slopes may divide by [m²], shape (H, 2)."""
    i, j, k, m = (rest[hinge[:, n]] for n in range(4))
    along = np.linalg.norm(j - i, axis=1)
    areas = np.stack([np.linalg.norm(np.cross(j - i, other - i), axis=1) for other in (k, m)], axis=1)
    height = areas.sum(axis=1) / np.maximum(along, 1e-30)
    solid = height > 1e-3 * along
    stiffness = np.where(solid, 6.0 * along / np.where(solid, height, 1.0), 0.0)
    return np.minimum(stiffness, 60.0), np.maximum(_THINNEST * areas, 1e-12 * along[:, None] ** 2)
