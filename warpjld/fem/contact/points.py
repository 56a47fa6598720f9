"""Contact points: what each of them weighs, where it looks, and how far it is from the other side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact.mortar import Mortar
from warpjld.fem.contact.obstacles import Obstacle
from warpjld.fem.contact.pairs import Pair
from warpjld.fem.contact.surface import ContactSurface, surface_of
from warpjld.fem.hexmesh import HexMesh

__all__ = ["ContactPoints", "Interface", "interfaces_of"]


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Where one pair may touch at one configuration; one point for each slave node that has something before it.

    The relative position of the two sides at a point is Σ_i c_i x_i (less the obstacle's own), averaged over the slave
    node's share of the surface (mortar method, Puso & Laursen 2004; rigid obstacles are asked at the node itself).

    Attributes:
        nodes: Slave node of each point, as an index into the surface's nodes, shape (m,).
        weights: c, one row a point, positive for the slave side, ``csr_array`` (m, N).
        normal: Direction to the other side, unit, shape (m, 3).
        area: Slave area the point stands for [m²], shape (m,).
        gap: Distance to the other side along ``normal``, negative where they overlap [m], shape (m,).
        carried: What the other side, if an obstacle, moved at the point since the start of the step [m], shape (m, 3).
    """

    nodes: NDArray[np.int64]
    weights: Any
    normal: NDArray[np.float64]
    area: NDArray[np.float64]
    gap: NDArray[np.float64]
    carried: NDArray[np.float64]

    def forces(self, traction: NDArray[np.float64]) -> NDArray[np.float64]:
        """Nodal forces of tractions (m, 3) that push on the slave [N], shape (N, 3); their sum is zero."""
        out: NDArray[np.float64] = self.weights.T @ (self.area[:, None] * traction)
        return out

    def relative(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ c_i u_i of a displacement (N, 3), shape (m, 3)."""
        out: NDArray[np.float64] = self.weights @ displacement
        return out


class Interface:
    """A pair, ready to be asked for its points at any configuration."""

    def __init__(self, mesh: HexMesh, pair: Pair, threads: int) -> None:
        self.pair = pair
        self.slave: ContactSurface = surface_of(mesh, pair.slave, f"{pair.title}: slave")
        self._count = len(mesh.nodes)
        self._mortar: Mortar | None = None
        if not isinstance(pair.master, Obstacle):
            master = surface_of(mesh, pair.master, f"{pair.title}: master")
            self._mortar = Mortar(self.slave, master, pair, self._count, threads)
            self.opposite = master.nodes
        else:
            self.opposite = np.empty(0, np.int32)

    @property
    def reach(self) -> float:
        """How far ahead a point looks [m]."""
        return 2.0 * float(self.slave.edge.max())

    def points(
        self, x: NDArray[np.float64], before: float, time: float, normals: NDArray[np.float64] | None = None
    ) -> ContactPoints:
        """Contact points at positions x (N, 3) and a time, for a step that began at ``before``.

        ``normals`` of the slave nodes (m, 3) are taken from x unless they are given.
        """
        if self._mortar is None:
            return self._against_obstacle(x, before, time)
        return self._mortar.points(x, self.reach, self.slave.normals(x) if normals is None else normals)

    def _against_obstacle(self, x: NDArray[np.float64], before: float, time: float) -> ContactPoints:
        from scipy.sparse import csr_array

        obstacle = self.pair.master
        assert isinstance(obstacle, Obstacle)
        surface = self.slave
        found = obstacle.project(x[surface.nodes], time)
        # the side that looks away from the obstacle's surface is not the one that touches it
        facing = np.einsum("ni,ni->n", surface.normals(x), found.normal) < 0.5
        near = np.flatnonzero((found.distance < self.reach) & (facing | (found.distance > 0.0)))
        area = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))[near]
        rows = np.arange(len(near) + 1)
        weights = csr_array((np.ones(len(near)), surface.nodes[near], rows), shape=(len(near), self._count))
        closest = found.closest[near]
        carried = closest - obstacle.carried(closest, time, before)
        return ContactPoints(near, weights, -found.normal[near], area, found.distance[near], carried)


def interfaces_of(mesh: HexMesh, pairs: list[Pair], threads: int) -> list[Interface]:
    """All pairs of a mesh.

    Raises:
        InputError: No pair, or one that names faces the mesh lacks.
    """
    if not pairs:
        raise InputError("pairs: want at least one pair of surfaces that may touch")
    return [Interface(mesh, pair, threads) for pair in pairs]
