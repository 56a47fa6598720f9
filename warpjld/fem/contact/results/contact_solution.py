"""Results of a contact solve: equilibria, contact of each pair, and the state to continue from."""

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
    """Contact of one pair at one instant; one row per slave node within the search distance of the other side.

    Attributes:
        name: The pair's ``label``.
        nodes: Nodes of the body, shape (m,).
        position: Their positions [m], shape (m, 3).
        normal: Unit normals, outward from the slave, shape (m, 3).
        pressure: [Pa], shape (m,); negative only at bonds.
        traction: Force per area on the slave, friction included [Pa], shape (m, 3).
        gap: Signed distance, negative for penetration [m], shape (m,).
        area: Tributary area of the slave node [m²], shape (m,).
        pressed: Part of it in contact; the border of contact is interpolated between nodes [m²], shape (m,).
        held: Part of that which sticks or is bonded; its border is interpolated as well [m²], shape (m,).
        slip: Tangential displacement relative to the other side in the last load step, or since contact began in it
            [m], shape (m, 3).
        sticking: Whether the node sticks or is bonded, shape (m,).
        bonded: Whether the bond holds, shape (m,).
        nodal: Contact forces on all nodes of the body, both sides [N], shape (N, 3).
        nodal_contact: Normal force, areas and slip on all nodes of the body, both sides.
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
        """Mask of rows with pressure or a bond, shape (m,)."""
        return (self.pressure > 0.0) | self.bonded

    @property
    def force(self) -> Array:
        """Resultant force on the slave [N], shape (3,)."""
        out: Array = self.area @ self.traction
        return out

    @property
    def normal_force(self) -> float:
        """∫ p dA [N]."""
        return float(self.area @ self.pressure)

    @property
    def contact_area(self) -> float:
        """Contact area [m²], with its border interpolated between nodes.

        Error of its radius against Hertz with five or more faces per radius: within 1.5 % at nodes against an obstacle,
        2 to 3 % too small with ``sites="faces"``, 1 to 2 % too small between two meshes (up to 8 % with two to four
        faces).
        """
        return float(self.pressed.sum())

    @property
    def peak(self) -> float:
        """Highest pressure [Pa]."""
        return float(self.pressure.max(initial=0.0))

    @property
    def centre(self) -> Array:
        """Centre of pressure [m], shape (3,); NaN without pressure."""
        weight = self.area * np.maximum(self.pressure, 0.0)
        total = float(weight.sum())
        return weight @ self.position / total if total > 0.0 else np.full(3, np.nan)

    @property
    def sliding(self) -> float:
        """Share of the contact area that slides; NaN without contact."""
        total = self.contact_area
        return 1.0 - float(self.held.sum()) / total if total > 0.0 else float("nan")

    @property
    def penetration(self) -> float:
        """Deepest penetration [m], ≥ 0.

        Between two meshes that of weighted (mortar) gaps, which are constrained; single nodes of balls with
        non-matching faces penetrate the other side by up to a tenth of an edge, most at the border of contact.
        """
        return float(np.maximum(-self.gap, 0.0).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class ContactInstant:
    """Equilibrium at one time.

    Attributes:
        time: Time.
        displacement: Displacement from rest [m], shape (N, 3).
        reactions: Forces at prescribed degrees of freedom [N], zero elsewhere, shape (N, 3) (B eq. 8).
        touches: Contact of each pair.
        solves: Linear solves since the previous instant, failed steps included.
        iterations: Iterations of these.
        residual: True residual relative to the forces in balance, in float64.
        velocity: Velocities in a solve with inertia [m/s], shape (N, 3); None without.
    """

    time: float
    displacement: Array
    reactions: Array
    touches: tuple[PairContact, ...]
    solves: int
    iterations: int
    residual: float
    velocity: Array | None = None


@dataclass(frozen=True, eq=False)
class LastStep:
    """Start of the load step that found an equilibrium, as needed for its sensitivities.

    Attributes:
        time: Time at its start.
        displacement: Displacement at its start [m], shape (N, 3).
        slips: Slip of each interface's sites in the step, with friction [m], shape (s, 3).
        areas: Areas by which tractions at the sites were multiplied [m²], shape (s,).
    """

    time: float
    displacement: Array
    slips: tuple[Array, ...]
    areas: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Instants reached, and the state needed to continue from the last.

    Attributes:
        status: How the run ended.
        instants: One for each time reached, in order.
        message: Explanation of the status.
        states: Contact state of each pair at the last instant.
        steps: Number of linear solves of each load step taken, including those added by halving.
        loads: Loads at the last instant.
        correction_rate: Deviation of the last step from its predictor per unit of time [m], shape (N, 3); None if not
            known.
        last_step: Start of the step that found the last instant; None if not known.
        spent: Linear solves of the run, those in vain included.
        pressed: Highest pressure at the last equilibrium, also between the times asked for [Pa].
    """

    status: SolveStatus
    instants: tuple[ContactInstant, ...]
    message: str
    states: tuple[ContactState, ...]
    steps: tuple[int, ...]
    loads: Loads
    correction_rate: Array | None = None
    last_step: LastStep | None = None
    spent: int = 0
    pressed: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether the last time was reached."""
        return self.status is SolveStatus.CONVERGED

    @property
    def last(self) -> ContactInstant:
        """The last equilibrium."""
        return self.instants[-1]


class ContactError(WarpjldError):
    """A contact solve did not reach its last time; ``solution`` holds the instants found."""

    def __init__(self, solution: ContactSolution) -> None:
        self.solution = solution
        super().__init__(solution.message)


class ContactWarning(UserWarning):
    """Warning that the mesh is too coarse to resolve contact: forces are too low, or governed by single faces."""
