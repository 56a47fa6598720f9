"""Contact of deformable bodies with each other, themselves and obstacles; friction, bonds (B §3.4, R108–R130)."""

from warpjld.fem.contact.interface.pairs import Bond, Exclusion, Pair
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Obstacle
from warpjld.fem.contact.press import press
from warpjld.fem.contact.results.contact_solution import (
    ContactError,
    ContactInstant,
    ContactSolution,
    ContactWarning,
    PairContact,
)

__all__ = [
    "Bond",
    "ClosestPoints",
    "ContactError",
    "ContactInstant",
    "ContactSolution",
    "ContactWarning",
    "Exclusion",
    "Obstacle",
    "Pair",
    "PairContact",
    "press",
]
