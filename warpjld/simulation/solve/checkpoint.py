"""Checkpoint files: solved frames and contact state, from which a run resumes."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.fem import Loads, SolveStatus
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.results.contact_solution import LastStep
from warpjld.fem.contact.results.nodal_contact import NodalContact
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.files.whole_file import whole_file
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.bone_clearance import TightBone
from warpjld.simulation.solve.checked_checkpoint import check_checkpoint, check_handed_over, plain_record
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.simulation.solve.handed_over import HandedOver
from warpjld.simulation.solve.identity import differences
from warpjld.simulation.solve.missed_contacts import MissedContact
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["Checkpoint", "CheckpointFile", "load_checkpoint", "save_checkpoint"]

_NAMED = 6
"""Most differing parts that a message names."""
_KIND = "a state of a contact solve"
"""Name of the file format in messages."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Solved frames, and the state from which the run resumes.

    Attributes:
        frames: Solved frames in order.
        solution: Solution of the last of them.
        edits: Edits of the animation so far.
        limits: State of the force limits, see ``ForceLimits.content``.
        missed: Contacts between frames.
        tight: Frame and smallest clearance between bone and object, by actor, digit and object.
        grips: Grips found so far, as plain values (``grip_content``).
        edited: Number of edits at the time each frame was solved.
        corrected: Digits that corrections opened.
        uncorrected: Messages about digits that corrections could not help.
        identity: Hashes of the simulation it belongs to, by name of the part (see ``identity_of``).
        over: Equilibrium with which frames go on once a hand alone holds what it lifts; None if there is none ahead.
    """

    frames: tuple[SolvedFrame, ...]
    solution: ContactSolution
    edits: tuple[AngleEdit, ...] = ()
    limits: dict[str, Any] = field(default_factory=dict)
    missed: tuple[MissedContact, ...] = ()
    tight: tuple[tuple[float, TightBone], ...] = ()
    grips: tuple[dict[str, Any], ...] = ()
    edited: tuple[int, ...] = ()
    corrected: tuple[CorrectedDigit, ...] = ()
    uncorrected: tuple[str, ...] = ()
    identity: Mapping[str, str] = field(default_factory=dict)
    over: HandedOver | None = None


@dataclass(frozen=True)
class CheckpointFile:
    """A checkpoint file and the simulation it has to belong to.

    Attributes:
        path: The file.
        belongs: Returns the identity of the simulation (see ``identity_of``); called when first needed.
    """

    path: Path
    belongs: Callable[[], Mapping[str, str]]

    def load(self, model: ContactModel, frames: Sequence[float]) -> Checkpoint | None:
        """Checkpoint of an earlier run; None if the file does not exist.

        Args:
            model: The contact model to solve.
            frames: Its frames.

        Raises:
            InputError: The file is no checkpoint, belongs to another simulation, or is inconsistent.
        """
        if not self.path.exists():
            return None
        found = load_checkpoint(self.path)
        if other := differences(found.identity, self.belongs()):
            named = ", ".join(other[:_NAMED]) + " and more" * (len(other) > _NAMED)
            raise InputError(
                f"this state belongs to another scene: {named} differ; remove it, or name another after STATE",
                path=self.path,
            )
        with reading(self.path, _KIND):
            check_checkpoint(found.frames, found.solution, found.edits, model, frames)
            if found.over is not None:
                check_handed_over(found.over, model)
        return found

    def save(self, state: Checkpoint) -> None:
        """Write the checkpoint.

        Raises:
            InputError: The file cannot be written.
        """
        save_checkpoint(self.path, state, self.belongs())


def save_checkpoint(path: Path, state: Checkpoint, identity: Mapping[str, str]) -> None:
    """Write a checkpoint atomically: an interruption leaves the previous file.

    Raises:
        InputError: The file cannot be written.
    """
    solution = state.solution
    arrays: dict[str, Any] = {
        "identity": json.dumps(dict(identity)),
        "time": solution.last.time,
        "edits": json.dumps([asdict(edit) for edit in state.edits]),
        "limits": json.dumps(state.limits),
        "missed": json.dumps([asdict(one) for one in state.missed]),
        "tight": json.dumps([[frame, asdict(bone)] for frame, bone in state.tight]),
        "grips": json.dumps(state.grips, default=lambda number: number.item()),
        "edited": np.array(state.edited, np.int64),
        "corrected": json.dumps([asdict(one) for one in state.corrected]),
        "uncorrected": json.dumps(state.uncorrected),
        "memories": len(solution.states),
    }
    # one array per field, stacked over frames, so that the number of members does not grow with the run
    for name in _names(SolvedFrame):
        arrays[f"frames.{name}"] = np.stack([getattr(frame, name) for frame in state.frames])
    for name in _names(NodalContact):
        arrays[f"frames.nodal_contact.{name}"] = np.stack([getattr(one.nodal_contact, name) for one in state.frames])
    if solution.correction_rate is not None:
        arrays["correction_rate"] = solution.correction_rate
    for k, memory in enumerate(solution.states):
        arrays |= {f"memory{k}.{name}": getattr(memory, name) for name in _names(ContactState)}
    if (over := state.over) is not None:
        arrays |= {"over.hand": over.hand, "over.free": over.free, "over.displacement": over.displacement}
        for k, memory in enumerate(over.states):
            arrays |= {f"over.memory{k}.{name}": getattr(memory, name) for name in _names(ContactState)}
    if (step := solution.last_step) is not None:
        arrays |= {"step.time": step.time, "step.displacement": step.displacement, "step.slips": len(step.slips)}
        arrays |= {f"step.slips{k}": one for k, one in enumerate(step.slips)}
        arrays |= {f"step.areas{k}": one for k, one in enumerate(step.areas)}
    try:
        with whole_file(path) as part, part.open("wb") as file:
            np.savez(file, **arrays)
    except OSError as error:
        raise InputError(f"cannot write: {error.strerror}", path=path) from error


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises:
        InputError: The file is no checkpoint.
    """
    check_input(path)
    with reading(path, _KIND):
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > path.stat().st_size:
                raise InputError("no state of a contact solve: it would unpack to more than it is")
        with np.load(path, allow_pickle=False) as file:
            if "identity" not in file:
                raise InputError("no state of a contact solve: it does not say what it belongs to")
            return _read(file)


def _read(file: Any) -> Checkpoint:
    columns = {name: file[f"frames.{name}"] for name in _names(SolvedFrame)}
    nodal = {name: file[f"frames.nodal_contact.{name}"] for name in _names(NodalContact)}
    if not columns["frame"].size:
        raise InputError("no state of a contact solve: it holds no frame")
    for name, array in [*columns.items(), *nodal.items()]:
        if array.shape[:1] != columns["frame"].shape:
            raise InputError(f"{name}: want one a frame, {columns['frame'].size}, got an array of shape {array.shape}")
    frames = []
    for k in range(len(columns["frame"])):
        one = {name: array[k] for name, array in columns.items()}
        one |= {"frame": float(one["frame"]), "solves": int(one["solves"]), "penetration": float(one["penetration"])}
        nodal_contact = NodalContact(**{name: array[k] for name, array in nodal.items()})
        frames.append(SolvedFrame(nodal_contact=nodal_contact, **one))
    states, over = _states(file, "memory"), None
    if "over.hand" in file:
        free, moved = float(file["over.free"]), file["over.displacement"]
        over = HandedOver(str(file["over.hand"]), free, moved, _states(file, "over.memory"))
    last, step = frames[-1], None
    if "step.time" in file:
        count = int(file["step.slips"])
        slips, areas = (tuple(file[f"step.{name}{k}"] for k in range(count)) for name in ("slips", "areas"))
        step = LastStep(float(file["step.time"]), file["step.displacement"], slips, areas)
    instant = ContactInstant(float(file["time"]), last.displacement, last.reactions, (), last.solves, 0, 0.0)
    rate = file.get("correction_rate")
    return Checkpoint(
        tuple(frames),
        ContactSolution(SolveStatus.CONVERGED, (instant,), "", states, (), Loads(), rate, step),
        tuple(plain_record(AngleEdit, one) for one in _json(file, "edits")),
        dict(_json(file, "limits")),
        tuple(plain_record(MissedContact, one) for one in _json(file, "missed")),
        tuple((float(frame), plain_record(TightBone, bone)) for frame, bone in _json(file, "tight")),
        tuple(dict(one) for one in _json(file, "grips")),
        tuple(int(count) for count in file["edited"]),
        tuple(plain_record(CorrectedDigit, one) for one in _json(file, "corrected")),
        tuple(str(one) for one in _json(file, "uncorrected")),
        {str(name): str(value) for name, value in dict(_json(file, "identity")).items()},
        over,
    )


def _states(file: Any, name: str) -> tuple[ContactState, ...]:
    """Contact states of all pairs."""
    count = range(int(file["memories"]))
    return tuple(ContactState(**{n: file[f"{name}{k}.{n}"] for n in _names(ContactState)}) for k in count)


def _json(file: Any, name: str) -> Any:
    return json.loads(str(file[name]))


def _names(kind: Any) -> list[str]:
    """Names of a dataclass's fields, without nested records."""
    return [one.name for one in fields(kind) if one.name != "nodal_contact"]
