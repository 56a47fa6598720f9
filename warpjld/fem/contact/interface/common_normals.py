"""Normals at the contact points between two meshes, from the facets of both sides.

Where the sides are pressed on each other both have the same normal. The facets' normals have it to the accuracy of
their mesh only: at the border of contact those of the rounder side already turn away, by some 15° at a fingertip with
elements of 3 mm. Pressure along such a normal pushes sideways, and as one half of a pad is pressed more than the other
where it holds a weight, that takes from what friction bears (a fifth at μ = 0.3) or adds to it. The flatter side knows
the normal better, so each side is weighted with the scatter of the other one's normals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.fem.contact.interface.contact_points import tangential
from warpjld.geometry.rotations import unit

__all__ = ["FacingParts"]

_EVEN = 1e-3
"""Scatter (1 − cosine) below which a surface is as good as plane: 2.6°."""


@dataclass(frozen=True, eq=False)
class FacingParts:
    """Integrals over those parts of each slave node's faces that face the other side, with shape functions N_a.

    The normal of a point is n = v / |v|, v = (σ_m + ε) V_s − (σ_s + ε) V_m, where V = Σ ∫ N_a n dA over the facets of
    slave and master with unit normals n, and the scatter σ = 1 − |V| / A, A = Σ ∫ N_a dA.

    Attributes:
        slave, master: V_s and V_m, shape (m, 3).
        area: A, shape (m,).
    """

    slave: Array
    master: Array
    area: Array

    @classmethod
    def of(cls, where: Ints | Ints32, count: int, share: Array, slave: Array, master: Array) -> FacingParts:
        """Sums over facet pairs.

        Args:
            where: Number of the point at each corner of the slave facets, shape (P, 4).
            count: Number of points.
            share: ∫ N_a dA over the common part of a pair, 0 where it belongs to no point [m²], shape (P, 4).
            slave, master: Unit normals of the facets, shape (P, 3).
        """
        rows = where.ravel()

        def summed(values: Array) -> Array:
            return np.asarray(np.bincount(rows, values.ravel(), minlength=count), np.float64)

        both = [np.stack([summed(share * side[:, None, k]) for k in range(3)], axis=1) for side in (slave, master)]
        return cls(both[0], both[1], summed(share))

    @property
    def scatter(self) -> tuple[Array, Array]:
        """σ of slave and master, shape (m,) each; 0 where nothing faces."""
        safe = np.where(self.area > 0.0, self.area, 1.0)
        out = [np.maximum(1.0 - np.linalg.norm(v, axis=1) / safe, 0.0) for v in (self.slave, self.master)]
        return out[0], out[1]

    @property
    def weights(self) -> tuple[Array, Array]:
        """Weights of V_s and of −V_m, shape (m,) each."""
        mine, other = self.scatter
        return other + _EVEN, mine + _EVEN

    @property
    def sum(self) -> Array:
        """v, shape (m, 3)."""
        mine, other = self.weights
        out: Array = mine[:, None] * self.slave - other[:, None] * self.master
        return out

    @property
    def normals(self) -> Array:
        """n, 0 where nothing faces, shape (m, 3)."""
        return unit(self.sum)

    def turned(self, rows: Ints, slave: Array, master: Array, area: Array) -> Array:
        """Changes of the normals of points ``rows`` (…) from changes of their V_s, V_m (…, k, 3) and A (…, k)."""
        mine, other = self.weights

        def scattered(of: Array, change: Array) -> Array:
            size = np.linalg.norm(of, axis=1)
            safe = np.where(self.area > 0.0, self.area, 1.0)
            along = (unit(of) / safe[:, None])[rows][..., None, :]
            return np.asarray((size / safe**2)[rows][..., None] * area - (along * change).sum(axis=-1))

        def at(values: Array) -> Array:
            return np.asarray(values[rows][..., None, :])

        out = at(mine[:, None]) * slave - at(other[:, None]) * master
        out += scattered(self.master, master)[..., None] * at(self.slave)
        out -= scattered(self.slave, slave)[..., None] * at(self.master)
        length, n = np.linalg.norm(self.sum, axis=1), at(self.normals)
        out -= n * (n * out).sum(axis=-1)[..., None]
        return np.asarray(out / at(np.where(length > 0.0, length, 1.0)[:, None]))

    def turned_along(self, vectors: Array) -> tuple[Array, Array, Array]:
        """Derivatives of a·n by V_s (m, 3), V_m (m, 3) and A (m,), for a vector a (m, 3) at each point."""
        mine, other = self.weights
        length = np.linalg.norm(self.sum, axis=1)
        across = tangential(vectors, self.normals) / np.where(length > 0.0, length, 1.0)[:, None]
        safe = np.where(self.area > 0.0, self.area, 1.0)
        one, two = (np.einsum("mi,mi->m", across, side) / safe for side in (self.slave, self.master))
        by_slave = mine[:, None] * across + two[:, None] * unit(self.slave)
        by_master = -other[:, None] * across - one[:, None] * unit(self.master)
        sizes = [np.linalg.norm(side, axis=1) for side in (self.slave, self.master)]
        return by_slave, by_master, (one * sizes[1] - two * sizes[0]) / safe
