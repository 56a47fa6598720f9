"""Frames that were solved, and all that is known of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from warpjld.fem import SolveStatus
from warpjld.fem.contact import ContactSolution
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.find import FoundGrip
from warpjld.simulation.solve.bone_clearance import TightBone
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.simulation.solve.force_limit import Stop
from warpjld.simulation.solve.missed_contacts import MissedContact
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["KnownEquilibrium", "SolveResult"]


@dataclass(frozen=True, eq=False)
class KnownEquilibrium:
    """A frame's equilibrium, and what it belongs to.

    Attributes:
        model: Everything, with the edits that held there.
        history: What was known before it.
        solution: Its last instant, without what touches.
    """

    model: ContactModel
    history: History
    solution: ContactSolution


@dataclass(frozen=True, eq=False)
class SolveResult:
    """Frames that were solved, and how it ended.

    Attributes:
        status: Of the last load step.
        message: For people.
        model: What was solved, with all edits.
        frames: In order.
        resumed: How many of them an earlier run left.
        missed: Touches between frames that no frame shows.
        edits: Angles that searches and corrections gave, in order.
        grips: What came of searches for a grip.
        corrected: Digits that corrections opened.
        uncorrected: What they could not, in words.
        stops: Digits that closed no farther.
        tight: Bones that came nearest to objects, of every digit and object the nearest.
        equilibria: Of each frame that this run solved, by its number: what it can be differentiated from.
        released: Frame after which what nothing holds any more falls, if it does: contact is not solved from there on.
        interrupted: Whether Ctrl-C ended it.
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
    interrupted: bool = False

    @property
    def start(self) -> float:
        """Frame of time 0."""
        return self.model.start
