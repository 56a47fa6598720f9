"""A pair in the paper's loop: penetrating nodes, their targets on the master, and contact forces (B Fig. 9, R113)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from warpjld.fem.arrays import Array, Ints
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.interface.surface import ContactSurface, surface_of
from warpjld.fem.contact.law.contact_state import ContactState, initial_state
from warpjld.fem.contact.obstacles.facets import Facets, Place
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.results.contact_solution import PairContact
from warpjld.fem.contact.results.nodal_contact import to_nodes

__all__ = ["Meeting", "Side"]

_DEEPEST = 5.0
"""Overlap, in element edges, beyond which a node is taken to face the master's far side."""


@dataclass(frozen=True, eq=False)
class Meeting:
    """Slave nodes of a pair to be repelled.

    Attributes:
        rows: Their indices into the slave's nodes, shape (m,).
        target: Positions on the master [m], shape (m, 3).
        normal: Outward normals of the master there, shape (m, 3).
        place: Positions in the master's triangles; None for an obstacle.
        distance: Signed distance, negative for overlap [m], shape (m,).
    """

    rows: Ints
    target: Array
    normal: Array
    place: Place | None
    distance: Array


class Side:
    """A pair, its surfaces, and the mask ``touching`` of its active slave nodes."""

    def __init__(self, body: Body, pair: Pair) -> None:
        self.pair = pair
        self.slave: ContactSurface = surface_of(body.mesh, pair.slave, f"{pair.title}: slave")
        self.touching = np.zeros(len(self.slave.nodes), dtype=bool)
        self.obstacle = pair.master if isinstance(pair.master, Obstacle) else None
        self.nodes = np.empty(0, np.int32)
        if not isinstance(pair.master, Obstacle):
            master = surface_of(body.mesh, pair.master, f"{pair.title}: master")
            self.nodes = master.nodes
            corners = master.corners
            self._facets = Facets(body.mesh.nodes[self.nodes], np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]]))
            self.triangles = self._facets.faces

    def state(self) -> ContactState:
        """Active nodes as a contact state, for a later run: nodes with a pressure."""
        return replace(initial_state(len(self.slave.nodes), self.pair), pressure=self.touching.astype(np.float64))

    def meet(self, x: Array, skin: Array, time: float) -> Meeting:
        """Nodes that overlap or were active at positions x (N, 3), and their closest points on the master at positions
        ``skin`` (N, 3)."""
        place = None
        points = x[self.slave.nodes]
        if self.obstacle is not None:
            found = self.obstacle.project(points, time)
        else:
            self._facets.move(skin[self.nodes])
            found, place = self._facets.locate(points)
        # sign by the nearest polygon's normal, since a master need not be closed
        depth = np.einsum("mi,mi->m", found.closest - points, found.normal)
        overlapping = (depth > 0.0) & (depth < _DEEPEST * self.slave.edge)
        rows = np.flatnonzero(overlapping | self.touching)
        if place is not None:
            place = Place(place.face[rows], place.weights[rows])
        return Meeting(rows, found.closest[rows], found.normal[rows], place, -depth[rows])

    def share(self, meeting: Meeting, reactions: Array, out: Array) -> Array:
        """Add compressive reactions of slave nodes (m, 3) [N] and the opposite forces on the facets' nodes to ``out``
        (N, 3); nodes in tension become inactive. Returns the forces that remain, shape (m, 3).
        """
        pushes = np.einsum("mi,mi->m", reactions, meeting.normal) > 0.0
        forces = reactions * pushes[:, None]
        self.touching[:] = False
        self.touching[meeting.rows[pushes]] = True
        np.add.at(out, self.slave.nodes[meeting.rows], forces)
        if meeting.place is not None:
            corners = self.nodes[self.triangles[meeting.place.face]]
            np.add.at(out, corners, -meeting.place.weights[:, :, None] * forces[:, None, :])
        return forces

    def touch(self, meeting: Meeting, forces: Array, x: Array) -> PairContact:
        """Contact of the pair from forces on its slave nodes (m, 3) [N] at positions x (N, 3) [m]."""
        surface = self.slave
        nodes = surface.nodes[meeting.rows]
        area = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))[meeting.rows]
        traction = forces / area[:, None]
        pressure = np.einsum("mi,mi->m", traction, meeting.normal)
        nodal = np.zeros_like(x)
        nodal[nodes] = forces
        there = csr_array((len(nodes), len(x)))
        if meeting.place is not None:
            corners = self.nodes[self.triangles[meeting.place.face]]
            np.add.at(nodal, corners, -meeting.place.weights[:, :, None] * forces[:, None, :])
            rows = 3 * np.arange(len(nodes) + 1)
            there = csr_array((meeting.place.weights.ravel(), corners.ravel(), rows), shape=there.shape)
        pressed, still = np.where(pressure > 0.0, area, 0.0), np.zeros((len(nodes), 3))
        return PairContact(
            self.pair.label,
            nodes,
            x[nodes],
            -meeting.normal,
            pressure,
            traction,
            meeting.distance,
            area,
            pressed,
            pressed,
            still,
            pressure > 0.0,
            np.zeros(len(nodes), dtype=bool),
            nodal,
            to_nodes(nodes, pressed * pressure, pressed, pressed, still, there, len(x)),
        )
