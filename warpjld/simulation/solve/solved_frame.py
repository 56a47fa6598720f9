"""Results of one solved frame: displacements, forces, pressures (R95)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.results.nodal_contact import NodalContact, stacked
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["SolvedFrame", "solved_frame"]


@dataclass(frozen=True, eq=False)
class SolvedFrame:
    """Equilibrium at one frame, of N nodes and P pairs.

    Attributes:
        frame: Frame number.
        displacement: Displacements of all nodes from time 0 [m], shape (N, 3).
        reactions: Reactions at the prescribed nodes [N], shape (N, 3).
        nodal: Contact forces of each pair on all nodes, friction included [N], shape (P, N, 3).
        nodal_contact: Normal force, contact area and slip of each pair on all nodes, shape (P, N).
        solves: Number of linear solves.
        penetration: Deepest penetration [m].
        bonded: Share of each pair's bond that still holds, 1 where there is none, shape (P,).
    """

    frame: float
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    nodal: NDArray[np.float64]
    nodal_contact: NodalContact
    solves: int
    penetration: float
    bonded: NDArray[np.float64]

    def pressure(self, model: ContactModel) -> NDArray[np.float64]:
        """Contact pressure at the nodes: normal force over tributary area [Pa], shape (N,)."""
        area = model.tributary_areas(model.body.mesh.nodes + self.displacement)
        force = self.nodal_contact.force.sum(axis=0)
        return np.divide(force, area, out=np.zeros(len(area)), where=area > 0.0)


def solved_frame(frame: float, instants: Sequence[ContactInstant], states: Sequence[ContactState] = ()) -> SolvedFrame:
    """Results of a frame: those of its last load step, with slip summed over its load steps.

    Args:
        frame: Frame number.
        instants: Equilibria of the load steps; the last is at the frame.
        states: Contact states of the last load step, by pair.
    """
    last = instants[-1]
    count = len(last.displacement)
    nodal = np.stack([t.nodal for t in last.touches]) if last.touches else np.zeros((0, count, 3))
    nodal_contact = stacked([t.nodal_contact for t in last.touches], count)
    slid = sum(
        (stacked([t.nodal_contact for t in instant.touches], count).slid for instant in instants[:-1]),
        nodal_contact.slid,
    )
    deepest = max((float(np.maximum(-t.gap, 0.0).max(initial=0.0)) for t in last.touches), default=0.0)
    solves = sum(instant.solves for instant in instants)
    whole = replace(nodal_contact, slid=slid)
    bonded = np.array([_bonded(state) for state in states] or [1.0] * len(last.touches))
    return SolvedFrame(frame, last.displacement, last.reactions, nodal, whole, solves, deepest, bonded)


def _bonded(state: ContactState) -> float:
    """Share of the initially bonded points that are still bonded."""
    at_first = np.isfinite(state.bond_gap)
    return float(state.bonded[at_first].mean()) if at_first.any() else 1.0
