"""A suspicious joint position, and its message."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["Finding", "millimetres", "one_per_joint"]

_WORDS = {
    "proportion": "is misplaced along its limb",
    "asymmetric": "is not where the other side's joint is",
    "midline": "is off the midline",
    "outside": "lies outside the surface",
    "off-centre": "is off-centre",
    "coincident": "shares its place with another joint",
    "leaves": "ends a segment that leaves the surface",
    "begins": "begins segments that leave the surface",
    "extremity": "is not at the centre of its extremity",
}


@dataclass(frozen=True)
class Finding:
    """A suspicious joint position.

    Attributes:
        joint: The joint, or the far end of the segment.
        kind: ``outside``, ``off-centre``, ``coincident``, ``leaves``, ``begins``, ``extremity``, ``proportion``,
            ``asymmetric`` or ``midline``.
        amount: Size of the deviation: a distance [m] for ``coincident``, else a ratio.
        detail: Description of the measurement for the user; may be empty.
        proposal: Displacement to the expected position [mm], or None if that is unknown.
        excess: Size of the deviation in units of its tolerance, where that is graded; 1 otherwise.
    """

    joint: str
    kind: str
    amount: float
    detail: str = ""
    proposal: tuple[float, float, float] | None = None
    excess: float = 1.0

    @property
    def message(self) -> str:
        """One line for the user."""
        text = f"{self.joint} {_WORDS[self.kind]}" + (f": {self.detail}" if self.detail else "")
        if self.proposal is None:
            return text
        x, y, z = self.proposal
        length = float(np.linalg.norm(self.proposal))
        return f"{text}; proposed: move it {length:.1f} mm, by ({x:+.1f}, {y:+.1f}, {z:+.1f}) mm"


def millimetres(offset: NDArray[np.float64]) -> tuple[float, float, float]:
    """A displacement [m], in mm, to two digits."""
    x, y, z = (round(1e3 * float(part), 2) for part in offset)
    return x, y, z


def one_per_joint(findings: list[Finding]) -> list[Finding]:
    """One finding per joint: the first, completed by the first proposal found for that joint.

    Of a joint outside, the nearest place inside is proposed only where nothing else says where it belongs."""
    best: dict[str, Finding] = {}
    for one in findings:
        had = best.get(one.joint)
        if had is None:
            best[one.joint] = one
        elif one.proposal is None or had.kind == "coincident":
            continue
        elif had.proposal is None or (had.kind == "outside" and one.kind in ("proportion", "asymmetric", "midline")):
            detail = ", ".join(part for part in (had.detail, one.detail) if part)
            best[one.joint] = replace(had, proposal=one.proposal, detail=detail)
    return list(best.values())
