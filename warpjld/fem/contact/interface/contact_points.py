"""Contact points of a pair at a configuration: weights, normals, areas and gaps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32

__all__ = ["ContactPoints", "tangential"]


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Where one pair may touch at one configuration; one point for each site that has something before it.

    The relative position of the two sides at a point is Σ_i c_i x_i, less the obstacle's own.

    Attributes:
        sites: Which of the interface's sites each point is, ascending, shape (m,).
        weights: c, one row a point, positive for the slave side, ``csr_array`` (m, N).
        normal: Direction to the other side, unit, shape (m, 3).
        area: Slave area the point stands for [m²], shape (m,).
        gap: Distance to the other side along ``normal``, negative where they overlap [m], shape (m,).
        carried: What the other side, if an obstacle, moved at the point since the start of the step [m], shape (m, 3).
        facets: Slave and master facets that face each other, if the master deforms too, shape (P, 2).
        share: Share of each two that counts, shape (P,).
        gap_derivative: How gaps change with the displacement (3N,), beyond what they do with weights and normals that
            stay, where that is known, ``csr_array`` (m, 3N).
    """

    sites: Ints
    weights: Any
    normal: Array
    area: Array
    gap: Array
    carried: Array
    facets: Ints32 | None = None
    share: Array | None = None
    gap_derivative: Any = None

    def forces(self, traction: Array) -> Array:
        """Nodal forces of tractions (m, 3) that push on the slave [N], shape (N, 3); their sum is zero."""
        out: Array = self.weights.T @ (self.area[:, None] * traction)
        return out

    def relative(self, displacement: Array) -> Array:
        """Σ c_i u_i of a displacement (N, 3), shape (m, 3)."""
        out: Array = self.weights @ displacement
        return out

    def opened(self, displacement: Array) -> Array:
        """By how much a displacement (N, 3) changes the gaps, to first order [m], shape (m,)."""
        out: Array = -np.einsum("mi,mi->m", self.normal, self.relative(displacement))
        return out if self.gap_derivative is None else out + self.gap_derivative @ displacement.reshape(-1)


def tangential(vectors: Array, normals: Array) -> Array:
    """Vectors (m, 3) less their parts along unit normals (m, 3)."""
    return np.asarray(vectors - np.einsum("mi,mi->m", vectors, normals)[:, None] * normals)
