"""Cache of values derived from a covering, with the covering's lifetime."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from warpjld.covering import Covering

__all__ = ["kept_with"]

T = TypeVar("T")


def kept_with(covering: Covering, make: Callable[[Covering], T]) -> T:
    """Value of ``make(covering)``, computed at the first call and cached on the covering."""
    kept: dict[Callable[[Covering], T], T] = vars(covering).setdefault("_made_of", {})
    if make not in kept:
        kept[make] = make(covering)
    return kept[make]
