"""Result of a grip search, and the table of the grips that were tried."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.grip.force import ForceStatus, PressedForce
from warpjld.simulation.grip.search import GripStatus, Trial
from warpjld.simulation.report.table import csv_cell
from warpjld.simulation.solve.handed_over import HandedOver
from warpjld.simulation.specification import GripSpecification

__all__ = ["FoundGrip", "SupportRelease", "digits_that_press", "trial_row", "write_grips"]

_PRESSES = 0.01
"""Force relative to that of the strongest digit above which a digit counts as pressing: flesh between two digits
transmits a little to both."""
_STEPS = 6
"""Load steps in which the weight is handed over and the object comes to rest; searches took 4 to 6."""
_REACHED = (
    *(GripStatus.HELD.name, GripStatus.HELD_AT_ONCE.name, GripStatus.HELD_SO_FAR.name),
    *(ForceStatus.REACHED.name, ForceStatus.UNEVEN.name),
)
"""Statuses of grips that are as asked."""
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
        begins: Time from which on it rides along with the closing hand [frames from the model's start].
        over: Time from which on its weight is handed over.
        free: Time from which on the hand alone holds it.
        drag: Drag with which its weight alone would move it by a twentieth of its height in a load step [N/m].
    """

    object: str
    begins: float
    over: float
    free: float
    drag: float

    @property
    def step(self) -> float:
        """Longest load step while its weight is handed over [frames]."""
        return (self.free - self.over) / _STEPS

    def applied(self, one: ObjectBody) -> ObjectBody:
        """The object with its support released, if it is the named one; others unchanged."""
        if one.name != self.object or one.support is None:
            return one
        return replace(one, support=one.support.released(self.begins, self.over, self.free, self.drag * self.step))


@dataclass(frozen=True, eq=False)
class FoundGrip:
    """Result of a grip search.

    Attributes:
        request: The specification of the grip.
        status: Name of the status with which the search ended.
        text: Summary in one line.
        grip: Angle by which the digits close further, the largest if they differ [rad]; 0 if no grip was found.
        lowered: Displacement of the object's middle along the axis of gravity when the hand takes its weight [m]; None
            if it does not.
        force: Sum of the normal forces on the object, or of the digits' forces [N].
        digits: Digit → force [N], force limit [N], largest load share.
        rows: One row for every grip tried, or for every digit of it where digits share.
        edits: Angles of the closing digits.
        release: Release of the object's support; None if it is not released.
        left_out: Digits that press with less than their share of the muscles, as far as they may bend on.
        on_bone: Those of them that may bend no farther because a bone would be inside the object.
        over: The equilibrium in which the hand alone holds the object; None if it does not, or after a checkpoint.
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
    left_out: tuple[str, ...] = ()
    on_bone: tuple[str, ...] = ()
    over: HandedOver | None = None

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search."""
        return self.status == GripStatus.INTERRUPTED.name

    @property
    def reached(self) -> bool:
        """Whether the hand holds, or presses, as asked."""
        return self.status in _REACHED

    @property
    def short(self) -> str:
        """What was not reached, as "LEFT at frame 24: 0.6 of 4 N (thumb 0.2 N, index 0.4 N): …"."""
        words = self.text
        if self.request.force is not None:
            each = ", ".join(f"{name.rpartition('.')[2]} {force:.2g} N" for name, (force, *_) in self.digits.items())
            why = next((one.value for one in ForceStatus if one.name == self.status), self.text)
            words = f"{self.force:.2g} of {self.request.force:.3g} N{f' ({each})' if each else ''}: {why}"
        return f"{self.request.actor} at frame {self.request.first:g}: {words}"

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


def digits_that_press(effort: Effort | None) -> dict[str, tuple[float, float, float]]:
    """Force, force limit and load share of the digits that press."""
    if effort is None:
        return {}
    least = _PRESSES * max(d.force for d in effort.digits)
    return {d.digit: (d.force, d.limit, d.share) for d in effort.digits if d.force > least}


def trial_row(
    request: GripSpecification, grip: float, tried: Trial | PressedForce, chosen: bool, status: str
) -> dict[str, Any]:
    """One row of the table of trials, without what only trials with a weight have."""
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
