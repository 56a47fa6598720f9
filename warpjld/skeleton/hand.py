"""The hand as the paper numbers it (A Figs 1 and 2, R7): 17 joints, two fixed carpal ends, five extremities.

Digits are named, ulnar to radial; the paper's numbers are an alias table.
"""

from __future__ import annotations

__all__ = ["DIGITS", "FINGER_JOINTS", "HAND_PARENTS", "PALM_SEGMENTS", "PAPER_NUMBERS", "hand_joint_names"]

DIGITS = ("pinky", "ring", "middle", "index", "thumb")

FINGER_JOINTS = ("base", "knuckle2", "knuckle3", "tip")

HAND_PARENTS: dict[str, str | None] = {"wrist": None} | {
    f"{digit}.{joint}": parent
    for digit in DIGITS
    for joint, parent in (
        ("carpometacarpal", "wrist"),
        ("base", "wrist" if digit == "thumb" else f"{digit}.carpometacarpal"),
        ("knuckle2", f"{digit}.base"),
        ("knuckle3", f"{digit}.knuckle2"),
        ("tip", f"{digit}.knuckle3"),
    )
    if not (digit == "thumb" and joint == "carpometacarpal")
}
"""Joint of a hand → its parent, parents first. Index and middle carpometacarpals are the fixed ends I and M."""

PALM_SEGMENTS = (
    ("pinky.carpometacarpal", "pinky.base"),
    ("ring.carpometacarpal", "ring.base"),
    ("middle.carpometacarpal", "middle.base"),
    ("index.carpometacarpal", "index.base"),
    ("thumb.base", "thumb.knuckle2"),
)
"""Segments 2→3, 1→6, M→9, I→12, 15→16; neighbours are adjacent."""

PAPER_NUMBERS: dict[int, str] = {0: "wrist", 1: "ring.carpometacarpal", 2: "pinky.carpometacarpal"} | {
    3 + 3 * d + k: f"{digit}.{FINGER_JOINTS[k]}" for d, digit in enumerate(DIGITS) for k in range(3)
}
"""The paper's joint numbers (A Fig. 2)."""


def hand_joint_names(side: str) -> tuple[str, ...]:
    """Canonical names of a hand's 25 joints for ``side`` "left" or "right", parents first."""
    return tuple(f"{side}.{name}" for name in HAND_PARENTS)
