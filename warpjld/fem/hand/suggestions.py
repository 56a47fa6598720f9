"""Words and numbers for the animator: how far to open which joint for which force (R119).

How a digit's force follows each of its joints, the equilibrium's tangent says (``contact.sensitivity``); how it
stiffens on the way, two instants of one press (``stiffening``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import JOINT_WORDS, Effort
from warpjld.fem.hand.stiffening import ForceSlope, way_to
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.tree import Skeleton

__all__ = ["DigitSlopes", "Suggestion", "suggestions"]

_LEAST = 1e-3
"""Slope over the largest of a digit's joints, below which a joint is no use."""


@dataclass(frozen=True, eq=False)
class DigitSlopes:
    """A digit's force at an instant, and how it follows its joints.

    Attributes:
        force: [N]
        slopes: Its derivatives by the flexion of base, knuckle 2 and knuckle 3 [N/rad], shape (3,).
    """

    force: float
    slopes: NDArray[np.float64]


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


def suggestions(
    skeleton: Skeleton,
    now: Effort,
    angles: NDArray[np.float64],
    slopes: Mapping[str, DigitSlopes] | None = None,
    before: Mapping[str, DigitSlopes] | None = None,
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
        slopes: How the digits' forces follow their joints, where it is known.
        before: The same at an earlier instant of the press, where there is one.
        aim: Share that is wanted.
        above: Share above which something is suggested.
    """
    out = []
    for digit in now.digits:
        if digit.share <= above:
            continue
        wanted = digit.force * aim / digit.share
        joints = [skeleton.index(f"{digit.digit}.{k}") for k in ("base", "knuckle2", "knuckle3")]
        known = (slopes or {}).get(digit.digit)
        if known is None or not (known.slopes > 0.0).any():
            text = f"{digit.text}; open it or move the hand back for {wanted:.2g} N (no stiffness is known)"
            out.append(Suggestion(digit.digit, "", math.nan, wanted, text))
            continue
        earlier = (before or {}).get(digit.digit)
        opening = np.array([_opening(earlier, known, joint, wanted) for joint in range(3)])
        room = angles[joints, FLEXION] - skeleton.limits[joints, FLEXION, 0]
        possible = np.where(opening <= room, opening, np.inf)
        best = int(np.argmin(possible if np.isfinite(possible).any() else opening))
        text = f"{digit.text}; open {JOINT_WORDS[best]} by {math.degrees(opening[best]):.1f}° for {wanted:.2g} N"
        if not np.isfinite(possible).any():
            text += f" (it can open by {math.degrees(room[best]):.1f}° only: move the hand back)"
        out.append(Suggestion(digit.digit, JOINT_WORDS[best], float(opening[best]), wanted, text))
    return tuple(out)


def _opening(before: DigitSlopes | None, now: DigitSlopes, joint: int, wanted: float) -> float:
    """How far a joint opens for a wanted force [rad]; infinite where that is no use."""
    slope = float(now.slopes[joint])
    if not slope > _LEAST * float(now.slopes.max()):
        return math.inf
    here, earlier = ForceSlope(now.force, slope), None
    if before is not None and 0.0 < before.force < now.force and before.slopes[joint] > 0.0:
        earlier = ForceSlope(before.force, float(before.slopes[joint]))
    return -way_to(wanted, here, earlier)
