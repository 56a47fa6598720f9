"""Checkpoints: all frames solved so far and the state of contact, in one file, from which a run goes on."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.fem import Loads, SolveStatus
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.results.nodal_contact import NodalContact
from warpjld.files.whole_file import whole_file
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.solve.identity import differences
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["Checkpoint", "CheckpointFile", "load_checkpoint", "save_checkpoint"]

_NAMED = 6
"""Parts that are named of what differs."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Frames so far, and the solution to go on from.

    Attributes:
        identity: What it belongs to: hashes by name (see ``identity_of``).
        frames: In order.
        solution: Of the last of them.
        edits: Angles that were found on the way.
        limits: Digits that have stopped: ``ForceLimits.content``.
    """

    identity: dict[str, str]
    frames: tuple[SolvedFrame, ...]
    solution: ContactSolution
    edits: tuple[AngleEdit, ...] = ()
    limits: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class CheckpointFile:
    """Where a run keeps its checkpoint.

    Attributes:
        path: The file.
        identity: What it is to belong to.
    """

    path: Path
    identity: dict[str, str]

    def load(self) -> Checkpoint | None:
        """What an earlier run left; None where there is none.

        Raises:
            InputError: It is no checkpoint, or one of something else.
        """
        if not self.path.is_file():
            return None
        found = load_checkpoint(self.path)
        if other := differences(found.identity, self.identity):
            named = ", ".join(other[:_NAMED]) + " and more" * (len(other) > _NAMED)
            raise InputError(
                f"this state belongs to another scene: {named} differ; remove it, or name another after STATE",
                path=self.path,
            )
        return found

    def save(
        self,
        frames: Sequence[SolvedFrame],
        solution: ContactSolution,
        edits: Sequence[AngleEdit] = (),
        limits: dict[str, Any] | None = None,
    ) -> None:
        """Keep what was solved so far.

        Raises:
            InputError: It cannot be written.
        """
        save_checkpoint(self.path, Checkpoint(self.identity, tuple(frames), solution, tuple(edits), limits or {}))


def save_checkpoint(path: Path, state: Checkpoint) -> None:
    """Write it beside its place and rename it: a cut leaves the one before.

    Raises:
        InputError: It cannot be written.
    """
    arrays: dict[str, Any] = {
        "identity": json.dumps(state.identity),
        "count": len(state.frames),
        "time": state.solution.last.time,
        "edits": json.dumps([asdict(edit) for edit in state.edits]),
        "limits": json.dumps(state.limits),
    }
    for k, frame in enumerate(state.frames):
        for one in fields(SolvedFrame):
            if one.name != "nodal_contact":
                arrays[f"frame{k}.{one.name}"] = getattr(frame, one.name)
        for one in fields(NodalContact):
            arrays[f"frame{k}.nodal_contact.{one.name}"] = getattr(frame.nodal_contact, one.name)
    if state.solution.correction_rate is not None:
        arrays["correction_rate"] = state.solution.correction_rate
    arrays["memories"] = len(state.solution.states)
    for k, memory in enumerate(state.solution.states):
        for one in fields(ContactState):
            arrays[f"memory{k}.{one.name}"] = getattr(memory, one.name)
    try:
        with whole_file(path) as part, part.open("wb") as file:
            np.savez(file, **arrays)
    except OSError as error:
        raise InputError(f"cannot write: {error.strerror}", path=path) from error


def load_checkpoint(path: Path) -> Checkpoint:
    """Read it.

    Raises:
        InputError: It is no state.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            if "identity" not in file:
                raise ValueError("it does not say what it belongs to")
            frames = []
            for k in range(int(file["count"])):
                nodal_contact = NodalContact(*(file[f"frame{k}.nodal_contact.{f.name}"] for f in fields(NodalContact)))
                one = {f.name: file[f"frame{k}.{f.name}"] for f in fields(SolvedFrame) if f.name != "nodal_contact"}
                one |= {"frame": float(one["frame"]), "solves": int(one["solves"])}
                one["penetration"] = float(one["penetration"])
                frames.append(SolvedFrame(nodal_contact=nodal_contact, **one))
            memory = tuple(
                ContactState(*(file[f"memory{k}.{f.name}"] for f in fields(ContactState)))
                for k in range(int(file["memories"]))
            )
            identity, time = json.loads(str(file["identity"])), float(file["time"])
            correction_rate = file.get("correction_rate")
            edits = tuple(AngleEdit(**edit) for edit in json.loads(str(file["edits"])))
            limits = json.loads(str(file["limits"]))
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"no state of a contact solve: {error}", path=path) from error
    last = frames[-1]
    instant = ContactInstant(time, last.displacement, last.reactions, (), last.solves, 0, 0.0)
    solution = ContactSolution(SolveStatus.CONVERGED, (instant,), "", memory, (), Loads(), correction_rate)
    return Checkpoint(identity, tuple(frames), solution, edits, limits)
