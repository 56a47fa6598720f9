"""Whether a grasp is realistic, in words and numbers (B §3.3, R112, R118, R119)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.fem import Status
from warpjld.simulation.report.table import ContactRow
from warpjld.simulation.report.visible_overlap import RemainingOverlap

if TYPE_CHECKING:
    from warpjld.simulation.solve_frames import SolveResult

__all__ = ["ContactVerdict", "verdict_of"]


@dataclass(frozen=True)
class ContactVerdict:
    """How a contact solve ended.

    Attributes:
        status: Name of the solver's status; ``OVERLAP`` where it did not keep apart what it was to.
        text: One line.
        lines: One for each digit that touched.
        suggestions: What to change.
        frames: First and last frame that were solved.
        grips: What came of searches for a grip.
        corrections: What was opened, and what could not be.
    """

    status: str
    text: str
    lines: tuple[str, ...]
    suggestions: tuple[str, ...]
    frames: tuple[float, float] | None
    grips: tuple[str, ...] = ()
    corrections: tuple[str, ...] = ()

    def content(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "status": self.status,
            "verdict": self.text,
            "digits": list(self.lines),
            "suggestions": list(self.suggestions),
            "grips": list(self.grips),
            "corrections": list(self.corrections),
            "frames": None if self.frames is None else list(self.frames),
        }


def verdict_of(
    solved: SolveResult,
    rows: Sequence[ContactRow],
    suggestions: Sequence[str],
    overlaps: Sequence[RemainingOverlap] = (),
) -> ContactVerdict:
    """Judge what was solved.

    Args:
        solved: The frames.
        rows: The table.
        suggestions: What the muscles' report suggests at the frame that strains them most.
        overlaps: What contact was to keep apart and did not, deepest first.
    """
    frames = (solved.frames[0].frame, solved.frames[-1].frame) if solved.frames else None
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
    over = [row for row in rows if row.share > 1.0]
    touched = any(row.force_n > 0.0 for row in rows)
    status = solved.status.name
    if solved.status not in (Status.CONVERGED, Status.STOPPED):
        text = f"no equilibrium: {solved.message}"
    elif overlaps:
        status = "OVERLAP"
        text = f"not solved: {overlaps[0].text}, and forces there are wrong"
    elif over:
        worst = max(over, key=lambda row: row.share)
        need = f"{100 * worst.share:.0f} % of what muscles can do"
        text = f"not realistic: at frame {worst.frame:g} {worst.digit} needs {need}"
    elif solved.status is Status.STOPPED:
        text = solved.message
    elif not rows:
        text = "solved"
    elif touched:
        share = max((row.share for row in rows if not np.isnan(row.share)), default=0.0)
        text = f"realistic: muscles do at most {100 * share:.0f} % of what they can"
    elif solved.missed:
        text = f"nothing touches at any frame, but between them: {solved.missed[0].text}"
    else:
        text = "nothing touches at any frame"
    return ContactVerdict(status, text, tuple(lines), tuple(suggestions), frames)
