"""What one frame of a contact solve leaves: shapes, forces, pressures (R95)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant
from warpjld.press.bodies import Bodies

__all__ = ["SolvedFrame", "TouchingPoints", "solved_frame"]


@dataclass(frozen=True, eq=False)
class TouchingPoints:
    """Points that touch, those of all pairs one after another.

    Attributes:
        pair: Number of the pair, shape (m,).
        node: Node of the slave, shape (m,).
        pressure: [Pa], shape (m,).
        area: [m²], shape (m,).
        position: [m], shape (m, 3).
        slides: Whether it slides, shape (m,).
        slip: Way along the other side since the instant before [m], shape (m, 3).
    """

    pair: NDArray[np.int32]
    node: NDArray[np.int32]
    pressure: NDArray[np.float64]
    area: NDArray[np.float64]
    position: NDArray[np.float64]
    slides: NDArray[np.bool_]
    slip: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SolvedFrame:
    """One frame.

    Attributes:
        frame: Its number.
        displacement: From time 0, of all nodes [m], shape (N, 3).
        reactions: Forces that hold the prescribed nodes [N], shape (N, 3).
        nodal: Contact forces of each pair on all nodes [N], shape (P, N, 3).
        touching: Points that touch.
        solves: Linear solves it took.
        penetration: Deepest overlap [m].
    """

    frame: float
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    nodal: NDArray[np.float64]
    touching: TouchingPoints
    solves: int
    penetration: float

    def pressure(self, bodies: Bodies) -> NDArray[np.float64]:
        """Contact pressure on the nodes [Pa], shape (N,): the solver's on slaves, force over area on masters."""
        mesh = bodies.body.mesh
        out = np.zeros(len(mesh.nodes))
        np.maximum.at(out, self.touching.node, np.maximum(self.touching.pressure, 0.0))
        masters: dict[str, NDArray[np.float64]] = {}
        for pair, forces in zip(bodies.pairs, self.nodal, strict=True):
            if isinstance(pair.master, str):
                masters.setdefault(pair.master, np.zeros_like(mesh.nodes))
                masters[pair.master] += forces
        for name, forces in masters.items():
            quads = mesh.quads(mesh.face_set(name))
            x = (mesh.nodes + self.displacement)[quads]
            facing = 0.125 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])  # a quarter of the area for each corner
            outward = np.zeros_like(mesh.nodes)
            np.add.at(outward, quads, facing[:, None].repeat(4, axis=1))
            area = np.linalg.norm(outward, axis=1)
            nodes = np.unique(quads)
            # a slave node presses on the four corners of a facet: averaged over the facets, the checks it leaves go
            push = np.maximum(-np.einsum("ni,ni->n", forces, outward), 0.0) / np.maximum(area, 1e-300)
            total, weight = np.zeros(len(out)), np.zeros(len(out))
            np.add.at(total, quads, push[quads].sum(axis=1, keepdims=True).repeat(4, axis=1))
            np.add.at(weight, quads, area[quads].sum(axis=1, keepdims=True).repeat(4, axis=1))
            out[nodes] = np.maximum(out[nodes], (total / np.maximum(weight, 1e-300))[nodes])
        return out


def solved_frame(frame: float, instant: ContactInstant) -> SolvedFrame:
    """What an equilibrium leaves."""
    touches = instant.touches
    count = len(instant.displacement)
    active = [touch.active for touch in touches]

    def joined(values: list[NDArray], empty: NDArray) -> NDArray:
        return np.concatenate([v[a] for v, a in zip(values, active, strict=True)]) if touches else empty

    touching = TouchingPoints(
        joined([np.full(len(t.nodes), k, np.int32) for k, t in enumerate(touches)], np.empty(0, np.int32)),
        joined([t.nodes for t in touches], np.empty(0, np.int32)),
        joined([t.pressure for t in touches], np.empty(0)),
        joined([t.area for t in touches], np.empty(0)),
        joined([t.position for t in touches], np.empty((0, 3))),
        joined([~t.sticking for t in touches], np.empty(0, bool)),
        joined([t.slip for t in touches], np.empty((0, 3))),
    )
    nodal = np.stack([t.nodal for t in touches]) if touches else np.zeros((0, count, 3))
    deepest = max((float(np.maximum(-t.gap, 0.0).max(initial=0.0)) for t in touches), default=0.0)
    return SolvedFrame(frame, instant.displacement, instant.reactions, nodal, touching, instant.solves, deepest)
