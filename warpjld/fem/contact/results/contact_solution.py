"""Results of a contact solve: equilibria, each pair's contact in them, and the state to go on from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import WarpjldError
from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.results.nodal_contact import NodalContact
from warpjld.fem.load.loads import Loads
from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["ContactError", "ContactInstant", "ContactSolution", "ContactWarning", "LastStep", "PairContact"]


@dataclass(frozen=True, eq=False)
class PairContact:
    """One pair at one instant; one row for each slave node that has something before it.

    Attributes:
        name: The pair's ``label``.
        nodes: Nodes of the body, shape (m,).
        position: Where they are [m], shape (m, 3).
        normal: Unit, outward from the slave, shape (m, 3).
        pressure: [Pa], shape (m,); negative only where a bond holds.
        traction: Force per area on the slave, friction included [Pa], shape (m, 3).
        gap: Distance, negative where the surfaces overlap [m], shape (m,).
        area: Slave area of each row [m²], shape (m,).
        pressed: The part of it inside the border of contact, which runs between nodes [m²], shape (m,).
        held: The part of that which friction or a bond holds; its border runs between nodes as well [m²], shape (m,).
        slip: Tangential displacement relative to the other side since the instant before, or since friction took hold
            of what was apart then [m], shape (m, 3).
        sticking: Whether friction or a bond holds, shape (m,).
        bonded: Whether the bond still holds, shape (m,).
        nodal: Forces on every node of the body, both sides [N], shape (N, 3).
        nodal_contact: What presses, area and slip on every node of the body, both sides.
    """

    name: str
    nodes: Ints32
    position: Array
    normal: Array
    pressure: Array
    traction: Array
    gap: Array
    area: Array
    pressed: Array
    held: Array
    slip: Array
    sticking: Mask
    bonded: Mask
    nodal: Array
    nodal_contact: NodalContact

    @property
    def active(self) -> Mask:
        """Rows that press, or are bonded, shape (m,)."""
        return (self.pressure > 0.0) | self.bonded

    @property
    def force(self) -> Array:
        """Resultant on the slave [N], shape (3,)."""
        out: Array = self.area @ self.traction
        return out

    @property
    def normal_force(self) -> float:
        """∫ p dA [N]."""
        return float(self.area @ self.pressure)

    @property
    def contact_area(self) -> float:
        """Area under pressure [m²], inside a border that is finer than the mesh.

        Its radius beside Hertz's, five faces or more over it: within 1.5 % at nodes against an obstacle, 2 to 3 % less
        at ``sites="faces"``, 1 to 2 % less between two meshes (two to four faces over it: up to 8 % less).
        """
        return float(self.pressed.sum())

    @property
    def peak(self) -> float:
        """Highest pressure [Pa]."""
        return float(self.pressure.max(initial=0.0))

    @property
    def centre(self) -> Array:
        """Centre of pressure [m], shape (3,); NaN where nothing presses."""
        weight = self.area * np.maximum(self.pressure, 0.0)
        total = float(weight.sum())
        return weight @ self.position / total if total > 0.0 else np.full(3, np.nan)

    @property
    def sliding(self) -> float:
        """Share of the area under pressure that slides; NaN where nothing presses."""
        total = self.contact_area
        return 1.0 - float(self.held.sum()) / total if total > 0.0 else float("nan")

    @property
    def penetration(self) -> float:
        """Deepest overlap [m], ≥ 0.

        Between two meshes of averages over the nodes' surroundings, as they are held apart: single nodes of balls whose
        faces do not match stand up to a tenth of an edge inside the other side's polygons, most at contact's border.
        """
        return float(np.maximum(-self.gap, 0.0).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class ContactInstant:
    """Equilibrium at one time.

    Attributes:
        time: When.
        displacement: From rest [m], shape (N, 3).
        reactions: Forces that hold the prescribed degrees of freedom [N], zero elsewhere, shape (N, 3) (B eq. 8).
        touches: One for each pair.
        solves: Linear solves that this load step took, steps that failed included.
        iterations: Iterations of these.
        residual: True residual over the forces that balance, float64.
    """

    time: float
    displacement: Array
    reactions: Array
    touches: tuple[PairContact, ...]
    solves: int
    iterations: int
    residual: float


@dataclass(frozen=True, eq=False)
class LastStep:
    """Where the load step that found an equilibrium began: what its sensitivity is taken from.

    Attributes:
        time: At its start.
        displacement: At its start [m], shape (N, 3).
        slips: Of each interface's sites during the step, as friction counts them [m], shape (s, 3).
        areas: What tractions at the sites were multiplied with [m²], shape (s,).
    """

    time: float
    displacement: Array
    slips: tuple[Array, ...]
    areas: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Instants reached, and what is needed to go on from the last.

    Attributes:
        status: How it ended.
        instants: One for each time reached, in order.
        message: For people: what ended it.
        states: Contact state at the last instant, one for each pair.
        steps: Load steps taken between instants, those that halving added included, and linear solves of each.
        loads: The loads at the last instant.
        correction_rate: How fast the last step left what was expected [m per unit of time], (N, 3).
        last_step: Where the step began that found the last instant; None where that is not known.
    """

    status: SolveStatus
    instants: tuple[ContactInstant, ...]
    message: str
    states: tuple[ContactState, ...]
    steps: tuple[int, ...]
    loads: Loads
    correction_rate: Array | None = None
    last_step: LastStep | None = None

    @property
    def converged(self) -> bool:
        """Whether the last time was reached."""
        return self.status is SolveStatus.CONVERGED

    @property
    def last(self) -> ContactInstant:
        """The last equilibrium."""
        return self.instants[-1]


class ContactError(WarpjldError):
    """A contact solve that did not get to its last time. ``solution`` holds what was reached."""

    def __init__(self, solution: ContactSolution) -> None:
        self.solution = solution
        super().__init__(solution.message)


class ContactWarning(UserWarning):
    """Contact that the mesh is too coarse to see: its forces are too low, or follow single faces."""
