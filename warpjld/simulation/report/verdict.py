"""Verdict on a contact simulation: status, and whether the grasp is realistic (B §3.3, R112, R118, R119)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.fem import SolveStatus
from warpjld.simulation.report.balance import ObjectBalance, balances
from warpjld.simulation.report.table import ContactRow, JointOpening
from warpjld.simulation.report.visible_overlap import RemainingOverlap
from warpjld.simulation.solve.digit_loads import CRUSHING

if TYPE_CHECKING:
    from warpjld.simulation.solve_result import SolveResult

__all__ = ["CRUSHED", "RELEASED", "SHORT", "ContactVerdict", "verdict_of"]

CRUSHED = "CRUSHED"
"""Status of a simulation in which flesh is pressed beyond what it bears."""
RELEASED = "RELEASED"
"""Status of a simulation in which an object is no longer held, and falls."""
SHORT = "SHORT"
"""Status of a simulation in which a hand does not press or hold as asked."""
_PUSHED = 1e-5
"""Displacement from which a free object counts as pushed [m]; without weight it stays in place otherwise."""
_BEARS = 0.05
"""Share of the contact forces on an object from which a digit counts as holding it."""


@dataclass(frozen=True)
class ContactVerdict:
    """Verdict on a contact simulation.

    Attributes:
        status: Name of the solver's status; ``OVERLAP`` if bodies in contact still overlap, ``CRUSHED`` if flesh is
            pressed beyond what it bears, ``RELEASED`` if an object is no longer held and falls, ``SHORT`` if a hand
            does not press or hold as asked.
        text: Summary in one line.
        lines: One line for each digit in contact.
        suggestions: Suggested changes of the animation.
        frames: First and last solved frame; None without any.
        grips: Results of grip searches.
        corrections: Results of corrections.
        balance: Resultant force and moment on every object in contact at the last frame.
        stops: Digits that stopped at a limit, and how far they stay behind the animation.
        openings: Those of the suggestions that name a joint.
    """

    status: str
    text: str
    lines: tuple[str, ...]
    suggestions: tuple[str, ...]
    frames: tuple[float, float] | None
    grips: tuple[str, ...] = ()
    corrections: tuple[str, ...] = ()
    balance: tuple[str, ...] = ()
    stops: tuple[str, ...] = ()
    openings: tuple[JointOpening, ...] = ()

    @property
    def failed(self) -> bool:
        """Whether requested frames are missing or wrong, or a force or hold that was asked for is not reached."""
        return self.status not in (SolveStatus.CONVERGED.name, SolveStatus.STOPPED.name, CRUSHED, RELEASED)

    def content(self) -> dict[str, Any]:
        """The verdict as plain values for JSON."""
        return {
            "status": self.status,
            "verdict": self.text,
            "digits": list(self.lines),
            "suggestions": list(self.suggestions),
            "grips": list(self.grips),
            "corrections": list(self.corrections),
            "balance": list(self.balance),
            "stops": list(self.stops),
            "frames": None if self.frames is None else list(self.frames),
        }


def verdict_of(
    solved: SolveResult,
    rows: Sequence[ContactRow],
    suggestions: Sequence[JointOpening],
    overlaps: Sequence[RemainingOverlap] = (),
) -> ContactVerdict:
    """Verdict on solved frames.

    Args:
        solved: Result of the solve.
        rows: Rows of the contact table.
        suggestions: Suggestions from the muscle efforts at the frame of the largest load share.
        overlaps: Overlaps that contact should have removed, deepest first.
    """
    frames = (solved.frames[0].frame, solved.frames[-1].frame) if solved.frames else None
    lines = _digit_lines(rows)
    over = [row for row in rows if row.share > 1.0]
    crushed = max((row for row in rows if 1e3 * row.peak_kpa > CRUSHING), key=lambda row: row.peak_kpa, default=None)
    last = balances(solved.model, solved.frames[-1]) if solved.frames else []
    touched = any(row.force_n > 0.0 for row in rows)
    status = solved.status.name
    if solved.released is not None and solved.unsolved is not None:
        status = RELEASED
        text = (
            f"not held: {solved.message}; contact is not solved after frame {frames[1] if frames else solved.start:g}"
        )
    elif solved.status not in (SolveStatus.CONVERGED, SolveStatus.STOPPED):
        text = f"no equilibrium: {solved.message}"
    elif overlaps:
        status = "OVERLAP"
        text = f"not solved: {overlaps[0].text}, and forces there are wrong"
    elif crushed is not None:
        status = CRUSHED
        text = (
            f"not realistic: at frame {crushed.frame:g} {crushed.actor} {crushed.digit} is crushed, pressed with "
            f"{1e-3 * crushed.peak_kpa:.3g} MPa: hardly any flesh is left before its bone, and forces mean nothing"
        )
    elif over:
        worst = max(over, key=lambda row: row.share)
        need = f"{100 * worst.share:.0f} % of what muscles can do"
        text = f"not realistic: at frame {worst.frame:g} {worst.digit} needs {need}"
    elif solved.status is SolveStatus.STOPPED:
        text = solved.message
    elif solved.released is not None:
        status = RELEASED
        text = f"not held: nothing holds {solved.falls[0].listed} from frame {solved.released:g} on"
    elif short := [one.short for one in solved.grips if not one.reached]:
        status, text = SHORT, f"not as asked: {'; '.join(short)}"
    elif not rows:
        text = "solved"
    elif lost := _lost(solved):
        text = f"not held: {lost}"
    elif pushed := next((one for one in last if one.unbalanced), None):
        text = f"not balanced: at frame {pushed.frame:g} {pushed.text}"
    elif slides := _slides(rows, last):
        text = f"not held: {slides}"
    elif touched:
        share = max((row.share for row in rows if not np.isnan(row.share)), default=0.0)
        text = f"realistic: muscles do at most {100 * share:.0f} % of what they can"
    elif solved.missed:
        text = f"nothing touches at any frame, but between them: {solved.missed[0].text}"
    else:
        text = "nothing touches at any frame"
    balance, stops = tuple(one.text for one in last), _stops(solved, rows)
    said, openings = tuple(one.text for one in suggestions), tuple(one for one in suggestions if one.joint)
    return ContactVerdict(status, text, tuple(lines), said, frames, balance=balance, stops=stops, openings=openings)


def _digit_lines(rows: Sequence[ContactRow]) -> list[str]:
    """Messages about the largest force on each digit."""
    lines = []
    most: dict[tuple[str, str], ContactRow] = {}
    for row in rows:
        best = most.get((row.actor, row.digit))
        if row.force_n > 1e-9 and (best is None or row.force_n > best.force_n):
            most[row.actor, row.digit] = row
    for (actor, digit), row in most.items():
        line = (
            f"{actor} {digit}: {row.force_n:.3g} N against {row.against} at frame {row.frame:g}, "
            f"{row.area_mm2:.3g} mm², peak {row.peak_kpa:.3g} kPa, {row.state}"
        )
        if not np.isnan(row.share):
            line += (
                f"; bones bear {row.bone_n:.3g} N of {row.limit_n:.3g} N, {100 * row.share:.0f} % of what muscles can"
            )
        lines.append(line)
    return lines


def _lost(solved: SolveResult) -> str:
    """Message about free objects that slipped out of the hands; empty if there is none."""
    held: dict[str, float] = {}
    for frame in solved.frames:
        held |= {one.object: frame.frame for one in balances(solved.model, frame)}
    out, last = [], solved.frames[-1]
    for one in solved.model.objects:
        far = float(np.linalg.norm(last.displacement[solved.model.spans[one.name]], axis=1).max())
        if one.states or one.support is not None or held.get(one.name) == last.frame or far < _PUSHED:
            continue
        since = f"after frame {held[one.name]:g}" if one.name in held else "at any frame"
        out.append(f"{one.name} is pushed aside by {1e3 * far:.2g} mm, and nothing touches it {since}")
    return "; ".join(out)


def _slides(rows: Sequence[ContactRow], last: Sequence[ObjectBalance]) -> str:
    """Message about a digit that helps to hold an object and slides on it entirely at the last frame; empty if none."""
    grasped = {one.object: one for one in last if one.grasped}
    for row in rows:
        for name in row.against.split("+"):
            one = grasped.get(name)
            if one is None or row.frame != one.frame or row.force_n <= _BEARS * one.pressing:
                continue
            if row.state == "sliding":
                return f"at frame {row.frame:g} {row.actor} {row.digit} slides on {name} with all of its skin"
    return ""


def _stops(solved: SolveResult, rows: Sequence[ContactRow]) -> tuple[str, ...]:
    """Messages about digits that stopped short of the requested flexions."""
    out = []
    for stop in solved.stops:
        digit = stop.digit.rpartition(".")[2]
        short = max((r.short_deg for r in rows if (r.actor, r.digit) == (stop.actor, digit)), default=0.0)
        if short > 0.0:
            out.append(f"{stop.actor} {digit} stops at frame {stop.frame:.3g}, {short:.2g}° short: {stop.why}")
    return tuple(out)
