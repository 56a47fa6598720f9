"""What is made of a hand once, and kept as long as the hand is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from warpjld.covering import Covering

__all__ = ["kept_with"]

T = TypeVar("T")


def kept_with(covering: Covering, make: Callable[[Covering], T]) -> T:
    """``make(covering)``, the same every time it is asked for."""
    kept: dict[Callable[[Covering], T], T] = vars(covering).setdefault("_made_of", {})
    if make not in kept:
        kept[make] = make(covering)
    return kept[make]
