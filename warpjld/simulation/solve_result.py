"""Result of solving frames: equilibria, edits, grips and corrections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from warpjld.fem import SolveStatus
from warpjld.fem.contact import ContactSolution
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.found import FoundGrip
from warpjld.simulation.solve.bone_clearance import TightBone
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.simulation.solve.falling import Falls
from warpjld.simulation.solve.force_limit import Stop
from warpjld.simulation.solve.missed_contacts import MissedContact
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["KnownEquilibrium", "SolveResult"]


@dataclass(frozen=True, eq=False)
class KnownEquilibrium:
    """A frame's equilibrium with the model and history it was solved for, as needed to differentiate it.

    Attributes:
        model: The contact model with the edits valid at that frame.
        history: History before the frame.
        solution: The last load step, without its ``touches``.
    """

    model: ContactModel
    history: History
    solution: ContactSolution


@dataclass(frozen=True, eq=False)
class SolveResult:
    """Solved frames and how the run ended.

    Attributes:
        status: Status of the last load step.
        message: Explanation of the status in words.
        model: The contact model with all edits.
        frames: Solved frames in order.
        resumed: Number of frames taken from the state of an earlier run.
        missed: Contacts between two frames that neither of the frames shows.
        edits: Joint flexions set by grip searches, corrections and force limits, in order.
        grips: Results of the grip searches.
        corrected: Digits that corrections opened.
        uncorrected: Messages about digits that corrections could not help.
        stops: Digits that stopped at their force limit.
        tight: Frame and smallest clearance between bone and object, by actor, digit and object.
        equilibria: Equilibrium of each frame that this run solved, by frame number, for differentiation.
        released: Frame from which on unheld objects fall; None if there is none.
        falls: Falls of objects that were let go while contact was solved, in order.
        unsolved: Falls after which contact is not solved; None if it is solved to the end.
        interrupted: Whether Ctrl-C ended the run.
    """

    status: SolveStatus
    message: str
    model: ContactModel
    frames: tuple[SolvedFrame, ...] = ()
    resumed: int = 0
    missed: tuple[MissedContact, ...] = ()
    edits: tuple[AngleEdit, ...] = ()
    grips: tuple[FoundGrip, ...] = ()
    corrected: tuple[CorrectedDigit, ...] = ()
    uncorrected: tuple[str, ...] = ()
    stops: tuple[Stop, ...] = ()
    tight: tuple[tuple[float, TightBone], ...] = ()
    equilibria: Mapping[float, KnownEquilibrium] = field(default_factory=dict)
    released: float | None = None
    falls: tuple[Falls, ...] = ()
    unsolved: Falls | None = None
    interrupted: bool = False

    @property
    def converged(self) -> bool:
        """Whether all frames so far are solved."""
        return self.status is SolveStatus.CONVERGED

    @property
    def start(self) -> float:
        """Frame of time 0."""
        return self.model.start
