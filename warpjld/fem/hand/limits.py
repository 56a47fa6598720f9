"""Largest force of each digit (R118): defaults, and replacement of these."""

from __future__ import annotations

from collections.abc import Mapping

from warpjld.errors import InputError
from warpjld.skeleton.hand import DIGITS
from warpjld.suggest import one_of

__all__ = ["FORCE_LIMITS", "force_limits"]

FORCE_LIMITS: dict[str, float] = {"index": 59.0, "middle": 82.0, "ring": 59.0, "pinky": 33.0, "thumb": 69.0}
"""Largest force of each digit [N]. Fingers: grip of 235 N on a 45 mm cylinder (PMC3855544), shared 25/35/25/14 %.
Thumb: tip pinch, the lower end of the 69–103 N that pinch strength tables give for tip and key pinch."""


def force_limits(given: Mapping[str, float] | None = None) -> dict[str, float]:
    """The defaults, with those in ``given`` replaced.

    Args:
        given: Digit → largest force [N].

    Raises:
        InputError: An unknown digit, or a force that is not positive and finite.
    """
    out = dict(FORCE_LIMITS)
    for digit, force in (given or {}).items():
        if digit not in DIGITS:
            raise InputError(f"force limits: no digit '{digit}'{one_of(digit, DIGITS)}")
        if not 0.0 < force < float("inf"):
            raise InputError(f"force limit of the {digit}: want newtons above 0, got {force}")
        out[digit] = float(force)
    return out
