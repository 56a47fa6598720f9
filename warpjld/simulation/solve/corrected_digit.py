"""Record of the correction of a digit (R120), part of results and state files."""

from __future__ import annotations

import math
from dataclasses import dataclass

from warpjld.fem.hand.muscles import JOINT_WORDS

__all__ = ["CorrectedDigit"]


@dataclass(frozen=True)
class CorrectedDigit:
    """Correction of one digit at one frame.

    Attributes:
        actor: Name of the actor.
        frame: Frame number.
        digit: Name in the skeleton, as ``left.index``.
        before, after: Force before and after the correction [N].
        limit: Force limit [N].
        opened: Angles by which its joints were opened [rad].
        status: Name of the ``Correction`` status of the frame.
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
