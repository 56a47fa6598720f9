"""Grip searches during a solve: the smallest grip that holds an object, or the grip of a given force (R123, R124)."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.grip.force import ForceStatus, PressedForce, force_grip
from warpjld.simulation.grip.hold import HandTrials
from warpjld.simulation.grip.search import GripStatus, Trial, gentlest_grip
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.report.table import csv_cell
from warpjld.simulation.specification import GripSpecification
from warpjld.skeleton.channels import FLEXION

__all__ = ["FoundGrip", "SupportRelease", "find_grip", "write_grips"]

_START = math.radians(0.5)
"""First step of a search [rad]."""
_NEAR = 0.03
"""Tolerance of the smallest grip, relative to its force."""

_TRIALS = 10
"""Most grips tried; as a rule three or four are enough."""

_PRESSES = 0.01
"""Force relative to that of the strongest digit above which a digit counts as pressing: flesh between two digits
transmits a little to both."""

_HELD = (GripStatus.HELD, GripStatus.HELD_AT_ONCE, GripStatus.HELD_SO_FAR)
"""Statuses of a successful search."""
_COLUMNS = (
    *("actor", "object", "frame", "grip_deg", "outcome", "held", "borne", "force_n", "sliding", "share", "digit"),
    *("chosen", "status"),
)
"""Columns of the table of trials."""


@dataclass(frozen=True)
class SupportRelease:
    """Release of an object's support.

    Attributes:
        object: Name of the object.
        begins, free: Begin and end of the release [frames from the model's start].
        lowered: Displacement of the object's handle along the axis of gravity during the release [m].
    """

    object: str
    begins: float
    free: float
    lowered: float

    def applied(self, one: ObjectBody) -> ObjectBody:
        """The object with its support released, if it is the named one; others unchanged."""
        if one.name != self.object or one.support is None:
            return one
        return replace(one, support=one.support.released(self.begins, self.free, self.lowered))


@dataclass(frozen=True, eq=False)
class FoundGrip:
    """Result of a grip search.

    Attributes:
        request: The specification of the grip.
        status: Name of the status with which the search ended.
        text: Summary in one line.
        grip: Angle by which the digits close further [rad]; 0 if no grip was found.
        lowered: Displacement of the object's handle along the axis of gravity when the hand takes its weight [m]; None
            if it does not.
        force: Sum of the normal forces on the object, or of the digits' forces [N].
        digits: Digit → force [N], force limit [N], largest load share.
        rows: One row for every grip tried.
        edits: Angles of the closing digits.
        release: Release of the object's support; None if it is not released.
    """

    request: GripSpecification
    status: str
    text: str
    grip: float
    lowered: float | None
    force: float
    digits: Mapping[str, tuple[float, float, float]]
    rows: tuple[dict[str, Any], ...] = ()
    edits: tuple[AngleEdit, ...] = ()
    release: SupportRelease | None = None

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search."""
        return self.status == GripStatus.INTERRUPTED.name

    def content(self) -> dict[str, Any]:
        """The result as plain values for JSON."""
        return {
            "actor": self.request.actor,
            "object": self.request.object,
            "frame": self.request.first,
            "status": self.status,
            "message": self.text,
            "grip_degrees": round(math.degrees(self.grip), 4),
            "force_n": self.force,
            "digits": {
                name: {"force_n": force, "limit_n": limit, "share": share}
                for name, (force, limit, share) in self.digits.items()
            },
            "trials": list(self.rows),
        }


def find_grip(
    model: ContactModel,
    history: History,
    request: GripSpecification,
    after: ContactSolution,
    limits: Mapping[str, float],
    tell: Callable[[str], None] = lambda line: None,
) -> FoundGrip:
    """Search for a grip from the equilibrium at its first frame; Ctrl-C ends the search with the trials so far.

    Args:
        model: The contact model.
        history: History at that frame.
        request: Specification of the grip.
        after: Equilibrium at its first frame.
        limits: Digit → force limit that differs from the default [N].
        tell: Called with a line about every grip tried.
    """
    hand = next(one for one in model.hands if one.name == request.actor)
    joints = [hand.bones.skeleton.index(channel.rpartition(".")[0]) for channel in request.channels]
    budget = SearchBudget() if request.lift else None
    squeeze = Squeeze(model, history, hand, joints, after, limits, budget)
    most = max(min(request.most, squeeze.room), 1e-6)
    found = _gentlest(request, squeeze, most, tell) if request.lift else _firm(request, squeeze, most, tell)
    release = None
    if found.lowered is not None:
        begins, free = request.middle - model.start, request.last - model.start
        release = SupportRelease(request.object, begins, free, found.lowered)
    return replace(found, edits=_edits(hand, request, joints, found.grip), release=release)


def _edits(hand: FleshBody, request: GripSpecification, joints: Sequence[int], grip: float) -> tuple[AngleEdit, ...]:
    """Edits that close the digits by a grip, up to their joint limits."""
    if grip == 0.0:
        return ()
    now = hand.bones.animation.angles(request.first)[joints, FLEXION]
    closed = np.maximum(now, np.minimum(now + grip, hand.bones.skeleton.limits[joints, FLEXION, 1]))
    return tuple(
        AngleEdit(hand.name, joint, request.first, None, float(value))
        for joint, value in zip(joints, closed, strict=True)
    )


def _gentlest(request: GripSpecification, squeeze: Squeeze, most: float, tell: Callable[[str], None]) -> FoundGrip:
    """Search for the smallest grip up to ``most`` [rad] that holds the object's weight."""
    model = squeeze.model
    one = next(body for body in model.objects if body.name == request.object)
    friction = max(
        pair.friction
        for pair, owner in zip(model.pairs, model.owners, strict=True)
        if owner.other(request.object) == request.actor
    )
    trials = HandTrials(squeeze, one)
    heavy = trials.weight.weight

    def hold(grip: float) -> Trial:
        trial = trials(grip)
        tell(f"{math.degrees(grip):.2f}°: {trial.force:.3g} N, {trial.outcome.value}")
        return trial

    start = min(_START, most)
    known = {"weight": heavy, "friction": friction, "start": start, "tolerance": _NEAR}
    found = gentlest_grip(hold, 0.0, most, **known, most=_TRIALS, exhausted=lambda: squeeze.budget.exhausted)
    taken = trials.taken(found.grip) if found.status in _HELD else None
    instant = squeeze.closed(found.grip).last if taken is None else taken[1]
    text = f"{heavy:.3g} N of {request.object}: {found.text}"
    if taken is not None:
        text += f"; the digits close on by {math.degrees(found.grip):.2f}°"
    text += f"; {found.ended}, with {squeeze.budget.spent} linear solves"
    effort = squeeze.effort(found.grip, instant) if instant.touches else None
    rows = [
        _row(request, grip, trial, grip == found.grip, found.status.name)
        | {"outcome": trial.outcome.name, "held": int(trial.held), "sliding": trial.sliding, "borne": trial.borne}
        for grip, trial in found.trials
    ]
    grip, lowered = (0.0, None) if taken is None else (found.grip, taken[0])
    digits = _digits(effort)
    return FoundGrip(request, found.status.name, text, grip, lowered, found.trial.force, digits, tuple(rows))


def _firm(request: GripSpecification, squeeze: Squeeze, most: float, tell: Callable[[str], None]) -> FoundGrip:
    """Search for the grip up to ``most`` [rad] whose digits press with the requested force."""
    assert request.force is not None
    counted = request.digits or tuple(dict.fromkeys(channel.split(".")[-3] for channel in request.channels))
    instants: dict[float, ContactInstant] = {}

    def press(grip: float) -> PressedForce | None:
        closed = squeeze.closed(grip)
        if not closed.converged:
            return None
        instants[grip] = closed.last
        effort = squeeze.effort(grip, closed.last)
        worst = max(effort.digits, key=lambda digit: digit.share)
        mine = [d.digit for d in effort.digits if d.digit.rpartition(".")[2] in counted]
        slopes = squeeze.slopes(grip, closed) if closed.last.touches else None
        slope = None if slopes is None else sum(slopes[digit].force for digit in mine)
        force = sum(effort[digit].force for digit in mine)
        tell(f"{math.degrees(grip):.2f}°: {force:.3g} N of {request.force:.3g} N")
        return PressedForce(force, worst.share, worst.digit, slope)

    found = force_grip(press, 0.0, most, request.force, start=min(_START, most))
    text = f"{' + '.join(counted)}: {found.text}"
    if found.status is ForceStatus.REACHED:
        text += f"; they close on by {math.degrees(found.grip):.2f}°"
    instant = instants.get(found.grip)
    effort = squeeze.effort(found.grip, instant) if instant is not None else None
    rows = [_row(request, grip, one, grip == found.grip, found.status.name) for grip, one in found.trials]
    force = found.pressed.force if found.pressed is not None else 0.0
    return FoundGrip(request, found.status.name, text, found.grip, None, force, _digits(effort), tuple(rows))


def _digits(effort: Effort | None) -> dict[str, tuple[float, float, float]]:
    """Force, force limit and load share of the digits that press."""
    if effort is None:
        return {}
    least = _PRESSES * max(d.force for d in effort.digits)
    return {d.digit: (d.force, d.limit, d.share) for d in effort.digits if d.force > least}


def _row(
    request: GripSpecification, grip: float, tried: Trial | PressedForce, chosen: bool, status: str
) -> dict[str, Any]:
    return {
        "actor": request.actor,
        "object": request.object,
        "frame": request.first,
        "grip_deg": round(math.degrees(grip), 5),
        "force_n": tried.force,
        "share": tried.share,
        "digit": tried.who,
        "chosen": int(chosen),
        "status": status,
    }


def write_grips(path: Path, found: Sequence[FoundGrip]) -> None:
    """Write every grip tried as CSV, one row each."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, _COLUMNS, restval="")
        writer.writeheader()
        for one in found:
            writer.writerows({key: csv_cell(value) for key, value in row.items()} for row in one.rows)
