"""Words and numbers for the animator: how far to open which joint for which force (R119).

A digit touches things through a spring: its force rises by k for every metre its load would move were nothing in the
way. A joint that turns by Δθ moves the load by its lever L = torque / force times Δθ. So k = ΔF / Σ L Δθ from the last
two instants, and opening one joint by (F − F*) / (k L) brings the force down to F*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import JOINT_WORDS, DigitEffort, Effort
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["Suggestion", "stiffness", "suggestions"]

_FLEXION = CHANNELS.index("flexion")


@dataclass(frozen=True)
class Suggestion:
    """One joint to turn.

    Attributes:
        digit: The digit.
        joint: ``base``, ``knuckle 2`` or ``knuckle 3``.
        opening: How far to open it [rad].
        wanted: Force after that [N].
        text: ``index 41 N of 59 N; open knuckle 2 by 3.2° for 30 N``.
    """

    digit: str
    joint: str
    opening: float
    wanted: float
    text: str


def stiffness(before: DigitEffort, now: DigitEffort, turned: NDArray[np.float64]) -> float | None:
    """k of a digit's contact [N/m] from two instants, or None where force did not rise with the joints.

    Args:
        before: The digit at the earlier instant.
        now: At the later one.
        turned: What its three joints flexed in between [rad], shape (3,).
    """
    moved = (
        float(0.5 * (before.levers + now.levers) @ turned)
        if before.force > 0.05 * now.force
        else (float(now.levers @ turned))
    )
    risen = now.force - before.force
    if abs(moved) < 1e-7 or risen / moved <= 0.0:
        return None
    return risen / moved


def suggestions(
    skeleton: Skeleton,
    now: Effort,
    angles: NDArray[np.float64],
    before: Effort | None = None,
    angles_before: NDArray[np.float64] | None = None,
    *,
    aim: float = 0.5,
    above: float = 1.0,
) -> tuple[Suggestion, ...]:
    """What to open, for every digit whose share is above a bound.

    The joint is the one that needs to turn least and may.

    Args:
        skeleton: Names and limits of the joints.
        now: The effort.
        angles: Joint angles [rad], shape (J, 4).
        before: The effort at an earlier instant, where there is one.
        angles_before: Its angles.
        aim: Share that is wanted.
        above: Share above which something is suggested.
    """
    out = []
    for digit in now.digits:
        if digit.share <= above:
            continue
        wanted = digit.force * aim / digit.share
        joints = [skeleton.index(f"{digit.digit}.{k}") for k in ("base", "knuckle2", "knuckle3")]
        k = None
        if before is not None and angles_before is not None:
            turned = angles[joints, _FLEXION] - angles_before[joints, _FLEXION]
            k = stiffness(before[digit.digit], digit, turned)
        room = angles[joints, _FLEXION] - skeleton.limits[joints, _FLEXION, 0]
        levers = digit.levers
        if k is None or not (levers > 1e-4).any():
            text = f"{digit.text}; open it or move the hand back for {wanted:.2g} N (no stiffness is known yet)"
            out.append(Suggestion(digit.digit, "", math.nan, wanted, text))
            continue
        opening = np.where(levers > 1e-4, (digit.force - wanted) / (k * np.maximum(levers, 1e-4)), np.inf)
        possible = np.where(opening <= room, opening, np.inf)
        best = int(np.argmin(possible if np.isfinite(possible).any() else opening))
        text = f"{digit.text}; open {JOINT_WORDS[best]} by {math.degrees(opening[best]):.1f}° for {wanted:.2g} N"
        if not np.isfinite(possible).any():
            text += f" (it can open by {math.degrees(room[best]):.1f}° only: move the hand back)"
        out.append(Suggestion(digit.digit, JOINT_WORDS[best], float(opening[best]), wanted, text))
    return tuple(out)
