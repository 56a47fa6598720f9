"""Text on pictures, in Pillow's built-in typeface."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

__all__ = ["font", "write"]


@lru_cache(maxsize=16)
def font(size: int) -> Any:
    """The typeface at a height [pixels]."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


def write(canvas: Any, place: tuple[float, float], text: str, *, size: int, color: str, anchor: str = "mm") -> None:
    """Write one line of text at a position [pixels]; ``anchor`` as in Pillow: ``mm`` centres it there, ``lm`` starts
    there."""
    from PIL import ImageDraw

    ImageDraw.Draw(canvas).text(place, text, fill=color, font=font(size), anchor=anchor)
