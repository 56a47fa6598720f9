"""Colour scales for numbers, with colour bars, and names of colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

__all__ = ["ColorScale", "as_hex"]


def as_hex(color: str) -> str:
    """A colour as ``#rrggbb``, from a CSS name in any case, or ``#rgb``, ``#rrggbb``.

    Raises:
        InputError: There is no such colour.
    """
    from matplotlib.colors import CSS4_COLORS, to_hex

    plain = color.replace(" ", "").lower()
    if plain not in CSS4_COLORS and not plain.startswith("#"):
        raise InputError(f"there is no colour '{color}'{did_you_mean(plain, CSS4_COLORS)}")
    try:
        return str(to_hex(plain))
    except ValueError:
        raise InputError(f"colour '{color}': want a name, or #rrggbb") from None


@dataclass(frozen=True)
class ColorScale:
    """Map of numbers between two limits to colours; numbers beyond a limit get its colour.

    Attributes:
        low: Number of the first colour.
        high: Number of the last colour.
        title: Quantity and unit.
        colormap: Name of a Matplotlib colour map, or colours to interpolate between.
        factor: Factor of the numbers on the bar, e.g. 1000 for metres shown in mm.
        highest: Whether ``high`` is written on the bar even if it is not a round number.
    """

    low: float
    high: float
    title: str = ""
    colormap: str | tuple[str, ...] = "viridis"
    factor: float = 1.0
    highest: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and self.low < self.high):
            raise InputError(f"colour scale: want low < high, got {self.low} and {self.high}")

    @classmethod
    def spanning(cls, values: ArrayLike, *, title: str = "", colormap: str = "viridis", factor: float = 1.0) -> Self:
        """A scale from the smallest to the largest of some numbers.

        Raises:
            InputError: No numbers, or not all finite.
        """
        numbers = np.asarray(values, np.float64)
        if numbers.size == 0 or not np.isfinite(numbers).all():
            raise InputError("colour scale: want at least one number, all finite")
        low, high = float(numbers.min()), float(numbers.max())
        if low == high:
            low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
        return cls(low, high, title, colormap, factor)

    def colors(self, values: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Colours, shape (n, 3), of numbers (n,)."""
        return self.table()[np.rint(np.clip(self.shares(values), 0, 1) * 255).astype(int)]

    def shares(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Position of numbers (n,) between ``low`` (0) and ``high`` (1), shape (n,)."""
        return np.asarray((values - self.low) / (self.high - self.low), np.float64)

    def drawn_on(self, picture: NDArray[np.uint8], ink: str) -> NDArray[np.uint8]:
        """The picture with a colour bar, its numbers and the title at the right border."""
        from PIL import Image

        from warpjld.render.text import write

        height, width = picture.shape[:2]
        size = max(10, round(height / 40))
        bar_width, bar_height = max(8, round(0.7 * size)), round(0.5 * height)
        left, top = width - bar_width - round(4.2 * size), round(0.25 * height)
        canvas = Image.fromarray(picture.copy())
        ramp = self.colors(np.linspace(self.high, self.low, bar_height))
        canvas.paste(Image.fromarray(np.repeat(ramp[:, None], bar_width, axis=1)), (left, top))
        for number in self.ticks(apart=1.3 * size / bar_height):
            y = top + bar_height * (1 - (number - self.low) / (self.high - self.low))
            text = f"{number * self.factor:.3g}"  # with a hyphen, since the built-in font has no minus sign
            write(canvas, (left + bar_width + 0.5 * size, y), text, size=size, color=ink, anchor="lm")
        if self.title:
            write(canvas, (width - 0.8 * size, top - 1.4 * size), self.title, size=size, color=ink, anchor="rm")
        return np.asarray(canvas)

    def ticks(self, apart: float = 0.0) -> NDArray[np.float64]:
        """Numbers to write beside the bar: four to eight round ones; with ``highest`` also ``high``.

        Args:
            apart: Share of the bar within which other numbers near ``high`` are left out then.
        """
        low, high = sorted((self.low * self.factor, self.high * self.factor))
        rough = (high - low) / 7.0
        power = 10.0 ** np.floor(np.log10(rough))
        step = power * next(n for n in (1.0, 2.0, 2.5, 5.0, 10.0) if n * power >= rough * (1.0 - 1e-9))
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        numbers = (step * np.arange(first, last + 1) + 0.0) / self.factor
        if self.highest:
            numbers = np.append(numbers[self.shares(numbers) < 1.0 - max(apart, 1e-9)], self.high)
        return np.asarray(numbers)

    def table(self) -> NDArray[np.uint8]:
        """The colours from ``low`` to ``high``, shape (256, 3)."""
        import matplotlib

        if isinstance(self.colormap, tuple):
            from matplotlib.colors import LinearSegmentedColormap

            mixed = LinearSegmentedColormap.from_list("own", self.colormap)
            return np.asarray(np.rint(255 * mixed(np.arange(256) / 255)[:, :3]), np.uint8)
        if self.colormap not in matplotlib.colormaps:
            raise InputError(f"no colour map '{self.colormap}'{did_you_mean(self.colormap, matplotlib.colormaps)}")
        colors = matplotlib.colormaps[self.colormap](np.arange(256) / 255)[:, :3]
        return np.rint(255 * colors).astype(np.uint8)
