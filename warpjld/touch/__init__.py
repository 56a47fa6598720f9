"""Geometric contact of the skin for display, without finite elements: overlaps are removed after deformation."""

from warpjld.touch.limit import LimitedDigit, close_until_touch
from warpjld.touch.touch import SHARE, Touch, Touched

__all__ = ["SHARE", "LimitedDigit", "Touch", "Touched", "close_until_touch"]
