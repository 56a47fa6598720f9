"""Contact of the skin without finite elements: a display of it, after the covering's operators."""

from warpjld.touch.limit import LimitedDigit, close_until_touch
from warpjld.touch.touch import SHARE, Touch, Touched

__all__ = ["SHARE", "LimitedDigit", "Touch", "Touched", "close_until_touch"]
