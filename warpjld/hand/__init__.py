"""The built-in hand, generated procedurally from measures (R7, R13)."""

from warpjld.hand.anthropometry import percentile
from warpjld.hand.build import build_hand

__all__ = ["build_hand", "percentile"]
