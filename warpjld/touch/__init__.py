"""Geometric contact of the skin for display, without finite elements: overlaps are removed after deformation."""

from warpjld.touch.limit import close_until_touch
from warpjld.touch.limited_digits import LimitedDigit
from warpjld.touch.touch import SHARE, Touch, Touched

__all__ = ["SHARE", "LimitedDigit", "Touch", "Touched", "close_until_touch"]
