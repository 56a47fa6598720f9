"""A digit that was opened at a frame since it bore more than its muscles can (R120)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from warpjld.fem.hand.muscles import JOINT_WORDS

__all__ = ["CorrectedDigit"]


@dataclass(frozen=True)
class CorrectedDigit:
    """One digit at one frame.

    Attributes:
        actor: Whose.
        frame: Number.
        digit: As ``left.index``.
        before, after: What it bore, and bears [N].
        limit: Largest force [N].
        opened: By how much its joints were opened [rad].
        status: Name of how the correction of the frame ended.
    """

    actor: str
    frame: float
    digit: str
    before: float
    after: float
    limit: float
    opened: tuple[float, float, float]
    status: str

    @property
    def text(self) -> str:
        """``index 71 N of 59 N at frame 36; opened knuckle 2 by 3.2° for 57 N``."""
        by = [f"{word} by {math.degrees(a):.1f}°" for word, a in zip(JOINT_WORDS, self.opened, strict=True) if a > 1e-6]
        out = f"{self.actor} {self.digit.rpartition('.')[2]} {self.before:.3g} N of {self.limit:.3g} N"
        return f"{out} at frame {self.frame:g}; opened {', '.join(by) or 'nothing'} for {self.after:.3g} N"
