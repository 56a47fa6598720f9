"""What one frame of a contact solve leaves: shapes, forces, pressures (R95)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant
from warpjld.fem.contact.imprint import Imprint, skin_around, stacked
from warpjld.press.bodies import Bodies

__all__ = ["SolvedFrame", "solved_frame"]


@dataclass(frozen=True, eq=False)
class SolvedFrame:
    """One frame.

    Attributes:
        frame: Its number.
        displacement: From time 0, of all nodes [m], shape (N, 3).
        reactions: Forces that hold the prescribed nodes [N], shape (N, 3).
        nodal: Contact forces of each pair on all nodes, friction included [N], shape (P, N, 3).
        imprint: What presses, its area and slip, of each pair on all nodes, shape (P, N).
        solves: Linear solves it took.
        penetration: Deepest overlap [m].
    """

    frame: float
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    nodal: NDArray[np.float64]
    imprint: Imprint
    solves: int
    penetration: float

    def pressure(self, bodies: Bodies) -> NDArray[np.float64]:
        """Contact pressure at the nodes: what presses on one over the area around it [Pa], shape (N,)."""
        mesh = bodies.body.mesh
        x = mesh.nodes + self.displacement
        area = np.zeros(len(x))
        for name in bodies.surfaces.values():
            area += skin_around(mesh, name, x)
        force = self.imprint.force.sum(axis=0)
        return np.divide(force, area, out=np.zeros(len(x)), where=area > 0.0)


def solved_frame(frame: float, instant: ContactInstant) -> SolvedFrame:
    """What an equilibrium leaves."""
    touches = instant.touches
    count = len(instant.displacement)
    nodal = np.stack([t.nodal for t in touches]) if touches else np.zeros((0, count, 3))
    imprint = stacked([t.imprint for t in touches], count)
    deepest = max((float(np.maximum(-t.gap, 0.0).max(initial=0.0)) for t in touches), default=0.0)
    return SolvedFrame(frame, instant.displacement, instant.reactions, nodal, imprint, instant.solves, deepest)
