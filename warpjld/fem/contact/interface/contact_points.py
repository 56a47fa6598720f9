"""Contact points of a pair at a configuration: weights, normals, areas and gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask

__all__ = ["ContactPoints", "tangential"]


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Candidate contact points of one pair at one configuration; one for each site within the search distance.

    The relative position of the two sides at a point is Σ_i c_i x_i, minus the obstacle's position.

    Attributes:
        sites: Index of each point's site, ascending, shape (m,).
        weights: c, one row per point, positive on the slave side, ``csr_array`` (m, N).
        normal: Unit normal towards the other side, shape (m, 3).
        area: Tributary area on the slave [m²], shape (m,).
        gap: Signed distance to the other side along ``normal``, negative for penetration [m], shape (m,).
        carried: Displacement of the obstacle at the point since the start of the step [m], shape (m, 3); 0 between
            meshes.
        facets: Slave and master facets that face each other, between meshes, shape (P, 2).
        share: Fraction of each facet pair that counts, shape (P,).
        gap_derivative: Derivative of the gaps by the displacement (3N,) due to changing weights and normals,
            ``csr_array`` (m, 3N); None if not computed.
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
        """Nodal forces of tractions (m, 3) on the slave [N], shape (N, 3); between meshes their sum is zero."""
        out: Array = self.weights.T @ (self.area[:, None] * traction)
        return out

    def relative(self, displacement: Array) -> Array:
        """Relative displacement Σ c_i u_i of the two sides for a displacement (N, 3), shape (m, 3)."""
        out: Array = self.weights @ displacement
        return out

    def opened(self, displacement: Array) -> Array:
        """Change of the gaps by a displacement (N, 3), to first order [m], shape (m,)."""
        out: Array = -np.einsum("mi,mi->m", self.normal, self.relative(displacement))
        return out if self.gap_derivative is None else out + self.gap_derivative @ displacement.reshape(-1)

    def shifted(self, move: Array) -> ContactPoints:
        """Points after a move (N, 3) by linearised kinematics: gaps change, normals and weights do not."""
        return replace(self, gap=self.gap + self.opened(move)) if move.any() else self

    def mobility(self, free: Mask) -> Array:
        """Share of the points' weights at free degrees of freedom (3N,) along the normal, shape (m,)."""
        share = abs(self.weights) @ free.reshape(-1, 3).astype(float)
        return np.asarray(np.einsum("mi,mi->m", share, self.normal**2))


def tangential(vectors: Array, normals: Array) -> Array:
    """Tangential parts of vectors (m, 3) with respect to unit normals (m, 3)."""
    return np.asarray(vectors - np.einsum("mi,mi->m", vectors, normals)[:, None] * normals)
