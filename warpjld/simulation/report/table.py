"""The table of a simulation: a row for each frame and digit, and what the muscles say (R95, R118–R122)."""

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
from warpjld.simulation.bodies.skin_parts import digit_of_label
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.skeleton.channels import FLEXION

__all__ = ["ContactRow", "ContactTable", "JointOpening", "digit_rows", "write_table"]


Slopes = Callable[[str, float, Mapping[str, float]], Mapping[str, DigitSlopes] | None]
"""Actor, frame, and force of some digits there [N] → digit → its force, and how that follows its joints."""


@dataclass(frozen=True)
class ContactRow:
    """What one digit feels and does at one frame.

    Attributes:
        frame: Number.
        actor: Whose.
        digit: ``index`` …, or ``palm``: everything else of the hand.
        against: What it touches, joined by ``+``.
        force_n: Length of the sum of its contact forces [N].
        fx_n, fy_n, fz_n: That sum [N].
        area_mm2: Area under pressure, inside a border that runs between nodes [mm²].
        peak_kpa: Highest pressure: what presses on a node over the skin around it [kPa]; the highest of all is the top
            of the pictures' scale.
        bone_n: Length of the sum of the reactions that hold its bones, less those of the same hand in the same pose
            when nothing touches it [N]. Where flesh is cut off, the cut bears with the bones that move it.
        flesh_n: Length of the latter [N]: of the weight of its flesh, and of the strain in it since time 0 where joints
            bend; NaN for the palm, and where the flesh alone finds no equilibrium: ``bone_n`` is then what contact
            hands on to the bones by nearness.
        limit_n: Largest force its muscles can bear [N]; NaN for the palm.
        share: Largest share of the limits of ``bone_n`` and of the torques it makes about the digit's joints; NaN for
            the palm.
        sliding: Share of the area under pressure that slides; NaN where nothing touches.
        state: ``free``, ``sticking``, ``sliding``, or ``partly sliding``.
        short_deg: How far the digit's joint that is farthest from what was asked of it stays short of it [degrees]; 0
            where none does, and for the palm.
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
    """A joint that should be opened, so that muscles can bear a digit's force.

    Attributes:
        actor: Whose.
        frame: Where it strains most.
        joint: Its name; empty where no joint is known that would help.
        degrees: How far to open it.
        text: The same, and why.
    """

    actor: str
    frame: float
    joint: str
    degrees: float
    text: str


class ContactTable:
    """Rows as frames are solved.

    Args:
        strength: Largest forces of digits [N], by actor and digit, where they are not the default.
        asked: The animation as it was asked for; where it is given, rows say how far digits stay short of it.

    Attributes:
        rows: Those so far.
    """

    def __init__(self, strength: Mapping[str, Mapping[str, float]], asked: Animation | None = None) -> None:
        self._strength, self._asked = strength, asked
        self.rows: list[ContactRow] = []
        self._efforts: dict[str, list[tuple[float, Effort]]] = {}

    def add(self, model: ContactModel, solved: SolvedFrame) -> str | None:
        """Add the rows of a frame; a text where muscles can do no more (R118)."""
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
        """How far digits stay short of what was asked [degrees]."""
        if self._asked is None or not hand.bones.bendable:
            return {}
        asked = self._asked.actors[hand.name].angles(frame)[:, FLEXION]
        missing = np.degrees(asked - hand.bones.animation.angles(frame)[:, FLEXION])
        out: dict[str, float] = {}
        for joint, name in enumerate(hand.bones.skeleton.names):
            digit, knuckle = name.split(".")[-2:] if name.count(".") else ("", name)
            if knuckle in KNUCKLES:
                out[digit] = max(out.get(digit, 0.0), round(float(missing[joint]), 6))
        return out

    def notes(self) -> list[str]:
        """Frames at which bones' forces are estimates."""
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
        """What to open, at the frame that strains an actor most, as the animation is after all.

        Args:
            model: As it is after all edits.
            slopes: How forces of an actor's digits follow their joints at a frame; None where that is not known.
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
    labels = [digit_of_label(name) for name in hand.hand.label_names]
    digit_of = np.array([*labels, ""])[hand.hand.node_labels]  # "" for nodes inside
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
    """Of a digit's nodes (n,), as the hand numbers them, with the pressure at all of the hand's nodes (N,) [Pa]."""
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
    """Write rows as CSV or, by the suffix, Parquet."""
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
        writer.writerows({k: _short(v) for k, v in asdict(row).items()} for row in rows)


def _short(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.6g}"


def _state(sliding: float) -> str:
    if np.isnan(sliding):
        return "free"
    return "sticking" if sliding < 0.05 else "sliding" if sliding > 0.95 else "partly sliding"
