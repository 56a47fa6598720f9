"""What a run that was cut off goes on from: all frames solved so far and the contact's memory, in one file."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.fem import Loads, Status
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.results.nodal_contact import NodalContact
from warpjld.press.frames import SolvedFrame
from warpjld.whole_file import whole_file

__all__ = ["State", "load_state", "save_state"]


@dataclass(frozen=True, eq=False)
class State:
    """Frames so far, and the solution to go on from.

    Attributes:
        mark: What it belongs to.
        frames: In order.
        solution: Of the last of them.
    """

    mark: str
    frames: tuple[SolvedFrame, ...]
    solution: ContactSolution


def save_state(path: Path, state: State) -> None:
    """Write it beside its place and rename it: a cut leaves the one before.

    Raises:
        InputError: It cannot be written.
    """
    arrays: dict[str, Any] = {"mark": state.mark, "count": len(state.frames), "time": state.solution.last.time}
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


def load_state(path: Path) -> State:
    """Read it.

    Raises:
        InputError: It is no state.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
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
            mark, time = str(file["mark"]), float(file["time"])
            correction_rate = file.get("correction_rate")
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"no state of a contact solve: {error}", path=path) from error
    last = frames[-1]
    instant = ContactInstant(time, last.displacement, last.reactions, (), last.solves, 0, 0.0)
    return State(
        mark, tuple(frames), ContactSolution(Status.CONVERGED, (instant,), "", memory, (), Loads(), correction_rate)
    )
