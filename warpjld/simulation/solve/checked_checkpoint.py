"""Validation of a checkpoint against the model: shapes, types, finite numbers and order of frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState, initial_state
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.handed_over import HandedOver
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.skeleton.channels import CHANNELS

__all__ = ["check_checkpoint", "check_handed_over", "plain_record"]

_T = TypeVar("_T")
_TYPES: dict[str, Any] = {
    "str": str,
    "int": int,
    "float": (int, float),
    "float | None": (int, float, type(None)),
}
"""Python types that JSON yields, by annotation of a record's field."""
_TRIPLE = "tuple[float, float, float]"
_MOST = 1e100
"""Magnitude that no state has in any unit; products of two numbers below it are finite."""
_UNKNOWN = ("bond_gap",)
"""Fields of a contact state that may be NaN (unknown)."""


def check_checkpoint(
    done: Sequence[SolvedFrame],
    solution: ContactSolution,
    edits: Sequence[AngleEdit],
    model: ContactModel,
    frames: Sequence[float],
) -> None:
    """Check that a run of a model over ``frames`` can resume after the frames ``done``.

    Raises:
        InputError: The checkpoint does not fit the model; names the first fault.
    """
    count, pairs = len(model.body.mesh.nodes), len(model.pairs)
    numbers = [one.frame for one in done]
    if numbers != [float(frame) for frame in frames[: len(numbers)]]:
        raise InputError(f"it holds frames {_listed(numbers)}; want the first ones of {_listed(list(frames))}")
    for one in done:
        what = f"frame {one.frame:g}"
        _check(one.displacement, (count, 3), f"{what}: displacements")
        _check(one.reactions, (count, 3), f"{what}: reactions")
        _check(one.nodal, (pairs, count, 3), f"{what}: contact forces")
        _check(one.bonded, (pairs,), f"{what}: shares of bonds")
        if not ((one.bonded >= 0.0) & (one.bonded <= 1.0)).all():
            raise InputError(f"{what}: shares of bonds: want 0 to 1")
        for part in fields(one.nodal_contact):
            _check(getattr(one.nodal_contact, part.name), (pairs, count), f"{what}: nodal {part.name}")
        if one.solves < 0 or not 0.0 <= one.penetration < np.inf:
            raise InputError(f"{what}: want numbers from 0 on, got {one.solves} solves, {one.penetration:g} m deep")
    if solution.last.time != done[-1].frame - model.start:
        raise InputError(f"its time {solution.last.time:g} is not that of frame {done[-1].frame:g}")
    if len(solution.states) != pairs:
        raise InputError(f"it holds contact states of {len(solution.states)} pairs; want {pairs}")
    for k, state in enumerate(solution.states):
        _check_state(state, model, k)
    if solution.correction_rate is not None:
        _check(solution.correction_rate, (count, 3), "rates of correction")
    _check_step(solution, count)
    for edit in edits:
        _check_edit(edit, model)


def check_handed_over(over: HandedOver, model: ContactModel) -> None:
    """Check that frames of a model can go on with an equilibrium of a lifted object.

    Raises:
        InputError: It does not fit the model; names the first fault.
    """
    if over.hand not in {hand.name for hand in model.hands}:
        raise InputError(f"it holds a grip of '{over.hand}', which is none of the hands")
    if not np.isfinite(over.free):
        raise InputError(f"its object is handed over at {over.free}; want a finite time")
    _check(over.displacement, (len(model.body.mesh.nodes), 3), "displacements of a grip")
    if len(over.states) != len(model.pairs):
        raise InputError(f"it holds contact states of {len(over.states)} pairs of a grip; want {len(model.pairs)}")
    for k, state in enumerate(over.states):
        _check_state(state, model, k)


def plain_record(kind: type[_T], content: Mapping[str, Any]) -> _T:
    """Instance of a dataclass of strings and finite numbers, from a JSON object.

    Raises:
        InputError: A field has another type, or is not finite.
    """
    for one in fields(kind):  # type: ignore[arg-type]
        value = content[one.name]
        triple = one.type == _TRIPLE
        parts = (value if isinstance(value, list) and len(value) == 3 else [None]) if triple else [value]
        want = _TYPES["float" if triple else str(one.type)]
        if not all(_is_plain(part, want) for part in parts):
            raise InputError(f"{one.name} of {kind.__name__}: want {one.type}, got {str(value)[:40]!r}")
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in content.items()})


def _is_plain(value: Any, want: Any) -> bool:
    finite = not isinstance(value, float) or bool(np.isfinite(value))
    return isinstance(value, want) and not isinstance(value, bool) and finite


def _check_state(state: ContactState, model: ContactModel, number: int) -> None:
    sites = len(state.pressure) if state.pressure.ndim == 1 else 0
    like = initial_state(sites, model.pairs[number])
    for one in fields(state):
        want = getattr(like, one.name)
        unknown = one.name in _UNKNOWN
        _check(getattr(state, one.name), want.shape, f"contact state {number}: {one.name}", want.dtype, unknown=unknown)


def _check_step(solution: ContactSolution, count: int) -> None:
    step = solution.last_step
    if step is None:
        return
    _check(step.displacement, (count, 3), "displacements before the last step")
    if len(step.slips) != len(solution.states) or not step.time < solution.last.time:
        raise InputError("its last step does not lead to its last frame")
    for k, (slips, areas, state) in enumerate(zip(step.slips, step.areas, solution.states, strict=True)):
        _check(slips, (len(state.pressure), 3), f"slips {k}")
        _check(areas, (len(state.pressure),), f"areas {k}")


def _check_edit(edit: AngleEdit, model: ContactModel) -> None:
    actors = {hand.name: hand.bones.skeleton for hand in model.hands}
    if edit.actor not in actors or not 0 <= edit.joint < len(actors[edit.actor]):
        raise InputError(f"it edits joint {edit.joint} of '{edit.actor}', which is not there")
    if not 0 <= edit.channel < len(CHANNELS):
        raise InputError(f"it edits angle {edit.channel} of a joint: want 0 … {len(CHANNELS) - 1}")


def _check(array: Any, shape: tuple[int, ...], what: str, kind: Any = np.float64, *, unknown: bool = False) -> None:
    if array.shape != shape or array.dtype != kind:
        raise InputError(f"{what}: want {np.dtype(kind)} of shape {shape}, got {array.dtype} of shape {array.shape}")
    if array.dtype.kind == "f" and not ((np.abs(array) < _MOST) | (unknown & np.isnan(array))).all():
        raise InputError(f"{what}: not finite" if not np.isfinite(array).all() else f"{what}: above {_MOST:g}")


def _listed(numbers: Sequence[float]) -> str:
    """The first four numbers as text."""
    return ", ".join(f"{number:g}" for number in numbers[:4]) + ", …" * (len(numbers) > 4)
