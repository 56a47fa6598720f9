"""Result of recognition: which joint of the file plays which role in a hand or body."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["BY_MAP", "HandRoles", "Roles"]

BY_MAP = "--map (inspect --write-map writes what was recognised, for editing)"
"""How to state joints, as used in warnings."""


@dataclass
class HandRoles:
    """One hand: canonical names without the side (``index.base``) → joint indices of the file."""

    side: str | None
    joints: dict[str, int]


@dataclass
class Roles:
    """All roles found in a file.

    Attributes:
        hands: Its hands, wrists included.
        body: Canonical names of all other joints (``left.elbow``, ``spine1``) → joint indices.
        how: ``names`` or ``shape``.
        notes: Decisions that differ from the joints' names.
        suspicious: Doubtful results, each with a remedy.
        left_out: Joints of the file that are not to be kept as joints.
    """

    hands: list[HandRoles] = field(default_factory=list)
    body: dict[str, int] = field(default_factory=dict)
    how: str = "names"
    notes: list[str] = field(default_factory=list)
    suspicious: list[str] = field(default_factory=list)
    left_out: frozenset[int] = frozenset()
