"""Contact table with one row per frame and digit, and suggestions from the muscle efforts (R95, R118–R122)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import KNUCKLES, Effort
from warpjld.fem.hand.suggestions import DigitSlopes, suggestions
from warpjld.simulation.animation import Animation
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.skeleton.channels import ABDUCTION, FLEXION

__all__ = ["ContactRow", "ContactTable", "JointOpening", "csv_cell", "digit_rows", "write_table"]


Slopes = Callable[[str, float, Mapping[str, float]], Mapping[str, DigitSlopes] | None]
"""Actor, frame, and force by digit [N] → force and its derivatives by the digit's joints, by digit; None if unknown."""


@dataclass(frozen=True)
class ContactRow:
    """Contact and effort of one digit at one frame.

    Attributes:
        frame: Frame number.
        actor: Name of the actor.
        digit: Digit (``index`` …), or ``palm`` for the rest of the hand.
        against: Names of the bodies and obstacles that it touches, joined by ``+``.
        force_n: Magnitude of the resultant of its contact forces [N].
        fx_n, fy_n, fz_n: Components of this resultant, world frame [N].
        area_mm2: Contact area; its border is interpolated between nodes [mm²].
        peak_kpa: Highest nodal pressure, i.e. normal force on a node divided by its tributary area [kPa]. The maximum
            over all rows is the upper end of the colour scale in pictures.
        bone_n: Magnitude of the resultant reaction at its bones, after subtracting that of the same hand in the same
            pose without contact [N]. Reactions where the flesh mesh is cut off count for the bones that move the cut.
        flesh_n: Magnitude of the subtracted reaction without contact [N], which is due to the weight of the flesh and
            its strain by flexion since time 0. NaN for the palm, and if the flesh has no equilibrium without contact;
            ``bone_n`` is then computed from contact forces assigned to the nearest bones.
        limit_n: Force limit of its muscles [N]; NaN for the palm.
        share: Muscle load: the largest of ``bone_n`` and the torques about the digit's joints, each relative to its
            limit; NaN for the palm.
        sliding: Share of the contact area that slides; NaN without contact.
        state: ``free``, ``sticking``, ``sliding``, or ``partly sliding``.
        short_deg: Largest lag of a joint's flexion or abduction in this digit behind the requested animation [degrees];
            0 without a lag, and for the palm.
    """

    frame: float
    actor: str
    digit: str
    against: str
    force_n: float
    fx_n: float
    fy_n: float
    fz_n: float
    area_mm2: float
    peak_kpa: float
    bone_n: float
    flesh_n: float
    limit_n: float
    share: float
    sliding: float
    state: str
    short_deg: float = 0.0


@dataclass(frozen=True)
class JointOpening:
    """Suggestion to open a joint, so that the muscles can bear a digit's force.

    Attributes:
        actor: Name of the actor.
        frame: Frame at which the muscles are loaded most.
        joint: Name of the joint; empty if no joint is known that would help.
        degrees: Angle by which to open it [degrees].
        text: The suggestion with its reason, for display.
    """

    actor: str
    frame: float
    joint: str
    degrees: float
    text: str


class ContactTable:
    """Contact table, filled as frames are solved.

    Args:
        strength: Force limits of digits that differ from the default [N], by actor and digit.
        requested: The animation without edits; if given, rows contain how far digits stay behind it.

    Attributes:
        rows: Rows so far.
    """

    def __init__(self, strength: Mapping[str, Mapping[str, float]], requested: Animation | None = None) -> None:
        self._strength, self._requested = strength, requested
        self.rows: list[ContactRow] = []
        self._efforts: dict[str, list[tuple[float, Effort]]] = {}

    def add(self, model: ContactModel, solved: SolvedFrame) -> str | None:
        """Add the rows of a frame; returns a message if the muscles exceed their limits (R118)."""
        reason = None
        for hand in model.hands:
            poses = hand.bones.animation.pose(solved.frame)
            effort = effort_at(model, hand, poses, solved, self._strength.get(hand.name))
            self._efforts.setdefault(hand.name, []).append((solved.frame, effort))
            short = self._short(hand, solved.frame)
            self.rows += [
                replace(row, short_deg=short.get(row.digit, 0.0)) for row in digit_rows(model, hand, solved, effort)
            ]
            reason = reason or effort.stop()
        return None if reason is None else f"stopped at frame {solved.frame:g}: {reason}"

    def _short(self, hand: FleshBody, frame: float) -> dict[str, float]:
        """Largest lag of each digit's angles behind the requested animation [degrees]."""
        if self._requested is None or not hand.bones.bendable:
            return {}
        lag = np.degrees(self._requested.actors[hand.name].angles(frame) - hand.bones.animation.angles(frame))
        missing = np.maximum(lag[:, FLEXION], np.abs(lag[:, ABDUCTION]))
        out: dict[str, float] = {}
        for joint, name in enumerate(hand.bones.skeleton.names):
            digit, knuckle = name.split(".")[-2:] if name.count(".") else ("", name)
            if knuckle in KNUCKLES:
                out[digit] = max(out.get(digit, 0.0), round(float(missing[joint]), 6))
        return out

    def notes(self) -> list[str]:
        """Messages about frames at which the forces at bones are estimates."""
        out = []
        for name, efforts in self._efforts.items():
            unsure = [frame for frame, effort in efforts if np.isnan(effort.digits[0].flesh)]
            if unsure:
                out.append(
                    f"{name}: flesh alone finds no equilibrium in the pose of frame "
                    f"{', '.join(f'{frame:g}' for frame in unsure)}: what bones bear is estimated from contact"
                )
        return out

    def suggestions(
        self, model: ContactModel, slopes: Slopes = lambda actor, frame, forces: None
    ) -> list[JointOpening]:
        """Suggestions which joints to open, at the frame of the largest load share of each actor.

        Args:
            model: The contact model with all edits.
            slopes: Derivatives of the digits' forces by their joints; None if not known.
        """
        out: list[JointOpening] = []
        for hand in model.hands:
            efforts = self._efforts.get(hand.name, [])
            if not efforts or not hand.bones.bendable:
                continue
            worst = max(range(len(efforts)), key=lambda k: efforts[k][1].share)
            frame, effort = efforts[worst]
            if effort.share <= 1.0:
                continue
            over = [digit.digit for digit in effort.digits if digit.share > 1.0]
            now, before = (
                slopes(hand.name, at, {digit: known[digit].force for digit in over})
                for at, known in (efforts[worst], efforts[max(worst - 1, 0)])
            )
            angles = hand.bones.animation.angles(frame)
            found = suggestions(hand.bones.skeleton, effort, angles, now, before if worst else None)
            for one in found:
                joint = f"{one.digit}.{one.joint.replace(' ', '')}" if one.joint else ""
                text = f"{hand.name} at frame {frame:g}: {one.text}"
                out.append(JointOpening(hand.name, frame, joint, math.degrees(one.opening), text))
        return out


def digit_rows(model: ContactModel, hand: FleshBody, solved: SolvedFrame, effort: Effort) -> list[ContactRow]:
    """Rows of a hand at a frame: its digits and its palm."""
    digits = [*(d.digit.rpartition(".")[2] for d in effort.digits), "palm"]
    digit_of = hand.node_digits
    pressure = solved.pressure(model)[model.spans[hand.name]]
    nodes = {digit: np.flatnonzero(digit_of == digit) for digit in digits}
    return [_row(model, hand, solved, effort, digit, nodes[digit], pressure) for digit in digits if len(nodes[digit])]


def _row(
    model: ContactModel,
    hand: FleshBody,
    solved: SolvedFrame,
    effort: Effort,
    digit: str,
    nodes: NDArray[np.integer],
    pressure: NDArray[np.float64],
) -> ContactRow:
    """Row of a digit with nodes (n,), indexed within the hand, and pressures at all nodes of the hand (N,) [Pa]."""
    span = model.spans[hand.name]
    nodal_contact = solved.nodal_contact.of((slice(None), span))
    pushes = solved.nodal[:, span][:, nodes]
    force = pushes.sum(axis=(0, 1))
    against = [
        str(owner.other(hand.name))
        for owner, push in zip(model.owners, pushes, strict=True)
        if np.abs(push).max(initial=0.0) > 0.0
    ]
    area = float(nodal_contact.area[:, nodes].sum())
    sliding = 1.0 - float(nodal_contact.held[:, nodes].sum()) / area if area > 0.0 else float("nan")
    work = None if digit == "palm" else effort[digit]
    return ContactRow(
        solved.frame,
        hand.name,
        digit,
        "+".join(dict.fromkeys(against)),
        float(np.linalg.norm(force)),
        float(force[0]),
        float(force[1]),
        float(force[2]),
        1e6 * area,
        1e-3 * float(pressure[nodes].max(initial=0.0)),
        float(np.linalg.norm(effort.palm)) if work is None else work.force,
        float("nan") if work is None else work.flesh,
        float("nan") if work is None else work.limit,
        float("nan") if work is None else work.share,
        sliding,
        _state(sliding),
    )


def write_table(path: Path, rows: Sequence[ContactRow]) -> None:
    """Write rows as Parquet if the suffix is ``.parquet``, otherwise as CSV."""
    columns = {name: [getattr(row, name) for row in rows] for name in ContactRow.__dataclass_fields__}
    if path.suffix.lower() == ".parquet":
        import pyarrow
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.table(columns), path)
        return
    import csv

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(columns))
        writer.writeheader()
        writer.writerows({k: csv_cell(v) for k, v in asdict(row).items()} for row in rows)


def csv_cell(value: object) -> object:
    """A value as written to CSV: floats with six digits, NaN empty."""
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.6g}"


def _state(sliding: float) -> str:
    if np.isnan(sliding):
        return "free"
    return "sticking" if sliding < 0.05 else "sliding" if sliding > 0.95 else "partly sliding"
