"""What calibration makes small: lost volume and stretched edges over a set of poses, with the gradient by positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.quality import closing_fans, enclosed_volume, unique_edges
from warpjld.surface import Surface

__all__ = ["DeformationLoss", "LossWeights"]

_POWER = 8
"""Exponent of the mean that stands for the worst edges: smooth, and near the largest of some thousand values."""

_SHORTEST = 1e-3  # stretch at which the logarithm is cut off


@dataclass(frozen=True)
class LossWeights:
    """Weights of the terms.

    Attributes:
        volume: Of the mean squared relative volume error; 1 % of volume then weighs like an all-over stretch of 10 %
            with the default.
        stretch: Of the mean squared logarithm of edge stretch.
        worst: Of the same, as a mean of a high power: the worst creases.
    """

    volume: float = 100.0
    stretch: float = 1.0
    worst: float = 0.3


class DeformationLoss:
    """L = w_v ⟨e²⟩ + w_s ⟨⟨s²⟩⟩ + w_w ⟨⟨s^p⟩^(2/p)⟩ with e = V/V₀ − 1 and s = log(l/l₀), means over edges and poses.

    Edges are weighted by their length at rest, so that a finely meshed nail does not outvote a palm.

    Args:
        surface: The rest surface.
        weights: Weights of the terms.
    """

    def __init__(self, surface: Surface, weights: LossWeights | None = None) -> None:
        self._weights = weights or LossWeights()
        count = len(surface.vertices)
        edges = unique_edges(surface.faces)
        rest = np.linalg.norm(surface.vertices[edges[:, 1]] - surface.vertices[edges[:, 0]], axis=1)
        edges, rest = edges[rest > 1e-9 * rest.max()], rest[rest > 1e-9 * rest.max()]
        self._rest_length = rest
        self._share = rest / rest.sum()
        row = np.arange(len(edges))
        signs = np.concatenate([-np.ones(len(edges)), np.ones(len(edges))])
        self._difference = sp.csr_array((signs, (np.tile(row, 2), edges.T.ravel())), shape=(len(edges), count))
        self._corners = _corner_matrices(surface.faces, count)
        self._volume = float(enclosed_volume(surface.vertices, surface.faces))

    def __call__(self, points: NDArray) -> tuple[float, NDArray[np.float64]]:
        """The loss of P poses and its derivative by the positions, both of shape (P, V, 3)."""
        poses, count = points.shape[:2]
        columns = np.ascontiguousarray(points.transpose(1, 0, 2), dtype=np.float64).reshape(count, 3 * poses)
        volume, volume_slope = self._volume_term(columns, poses)
        stretch, stretch_slope = self._stretch_term(columns, poses)
        slope = (volume_slope + stretch_slope).reshape(count, poses, 3).transpose(1, 0, 2)
        return volume + stretch, slope

    def _volume_term(self, columns: NDArray[np.float64], poses: int) -> tuple[float, NDArray[np.float64]]:
        a, b, c = ((m @ columns).reshape(-1, poses, 3) for m in self._corners)
        across = (np.cross(b, c), np.cross(c, a), np.cross(a, b))
        error = np.einsum("tpi,tpi->p", a, across[0]) / (6.0 * self._volume) - 1.0
        scale = (self._weights.volume * 2.0 / (6.0 * poses * self._volume)) * error
        slope = np.zeros_like(columns)
        for corner, normal in zip(self._corners, across, strict=True):
            slope += corner.T @ (scale[:, None] * normal).reshape(-1, 3 * poses)
        return self._weights.volume * float((error**2).mean()), slope

    def _stretch_term(self, columns: NDArray[np.float64], poses: int) -> tuple[float, NDArray[np.float64]]:
        along = (self._difference @ columns).reshape(-1, poses, 3)
        squared = np.maximum((along**2).sum(axis=2), (_SHORTEST * self._rest_length[:, None]) ** 2)
        log = 0.5 * np.log(squared) - np.log(self._rest_length)[:, None]
        share = self._share[:, None]
        high = share * np.abs(log) ** _POWER
        norm = np.maximum(high.sum(axis=0), 1e-60)
        worst = norm ** (2.0 / _POWER)
        w = self._weights
        value = w.stretch * (share * log**2).sum() + w.worst * worst.sum()
        # d(norm^(2/p))/ds = 2 norm^(2/p - 1) share s |s|^(p - 2)
        by_log = w.stretch * 2.0 * share * log
        by_log += w.worst * 2.0 * (worst / norm) * share * log * np.abs(log) ** (_POWER - 2)
        slope = self._difference.T @ ((by_log / squared)[..., None] * along).reshape(-1, 3 * poses)
        return float(value) / poses, slope / poses


def _corner_matrices(faces: NDArray[np.int32], count: int) -> list[sp.csr_array]:
    """Three matrices that take vertices to the corners of all faces, those that close open rims included."""
    boundary, loop = closing_fans(faces)
    rims = int(loop.max()) + 1 if len(loop) else 0
    members = np.bincount(loop, minlength=rims)
    pick = sp.eye_array(count, format="csr")
    mean = sp.csr_array((1.0 / members[loop], (loop, boundary[:, 0])), shape=(rims, count))
    ends = (pick[boundary[:, 1]], pick[boundary[:, 0]], mean[loop])
    return [sp.vstack([pick[faces[:, k]], ends[k]], format="csr") if rims else pick[faces[:, k]] for k in range(3)]
