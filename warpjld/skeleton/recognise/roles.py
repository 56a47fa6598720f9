"""What recognition finds: which joint of the file plays which part in a hand or body."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["BY_MAP", "HandRoles", "Roles"]

BY_MAP = "--map (inspect --write-map writes what was recognised, for editing)"
"""How joints are stated by hand, for messages of what is suspicious."""


@dataclass
class HandRoles:
    """One hand: canonical names without the side (``index.base``) → joint numbers of the file."""

    side: str | None
    joints: dict[str, int]


@dataclass
class Roles:
    """All parts found in a file.

    Attributes:
        hands: Its hands; their wrists are in ``body`` terms the arms' ends.
        body: Canonical names of everything else (``left.elbow``, ``spine1``) → joint numbers.
        how: ``names`` or ``shape``.
        notes: What was settled otherwise than names say.
        suspicious: What is doubtful, and what to do about it.
        left_out: Joints of the file that are to be no joints of their own.
    """

    hands: list[HandRoles] = field(default_factory=list)
    body: dict[str, int] = field(default_factory=dict)
    how: str = "names"
    notes: list[str] = field(default_factory=list)
    suspicious: list[str] = field(default_factory=list)
    left_out: frozenset[int] = frozenset()
