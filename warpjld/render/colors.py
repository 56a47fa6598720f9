"""Colour scales for numbers, with colour bars, and names of colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

__all__ = ["ColorScale", "as_hex"]

_PRESSURE = ("#b9b3aa", "#ebb54d", "#e2762f", "#c9302c", "#7a1030", "#3a0520")
_NOTHING = 1.0
"""Least upper end of a scale of pressures [Pa], where there is none."""
_APART, _DECADES = 0.08, 4
"""Least distance of numbers beside a scale with a power, over its length; decades below the highest that are tried."""
_ROOT = 0.5
"""Exponent of a scale of pressures: a digit pressed with a hundredth of the highest pressure is a tenth up the scale,
which can be told from none; linearly it is as good as none."""


def _bar(height: int) -> tuple[int, int, int]:
    """Size of the numbers, width of the bar, and width of the strip at the border that both take, in pixels."""
    size = max(10, round(height / 40))
    width = max(8, round(0.7 * size))
    return size, width, width + round(4.2 * size)


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
        power: Exponent of the position between the limits; below 1 it spreads small numbers.
    """

    low: float
    high: float
    title: str = ""
    colormap: str | tuple[str, ...] = "viridis"
    factor: float = 1.0
    highest: bool = False
    power: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and self.low < self.high):
            raise InputError(f"colour scale: want low < high, got {self.low} and {self.high}")
        if not self.power > 0.0:
            raise InputError(f"colour scale: want a power above 0, got {self.power}")

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

    @classmethod
    def of_pressure(cls, high: float) -> Self:
        """The scale of contact pressures from 0 to ``high`` [Pa], on which every digit that presses is seen."""
        title = "contact pressure, kPa"
        return cls(0.0, max(_NOTHING, high), title, _PRESSURE, factor=1e-3, highest=True, power=_ROOT)

    def colors(self, values: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Colours, shape (n, 3), of numbers (n,)."""
        return self.table()[np.rint(np.clip(self.shares(values), 0, 1) * 255).astype(int)]

    def shares(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Position of numbers (n,) between ``low`` (0) and ``high`` (1), shape (n,)."""
        out = np.asarray((values - self.low) / (self.high - self.low), np.float64)
        return out if self.power == 1.0 else np.asarray(np.maximum(out, 0.0) ** self.power)

    def drawn_on(self, picture: NDArray[np.uint8], ink: str) -> NDArray[np.uint8]:
        """The picture with a colour bar, its numbers and the title at the right border."""
        from PIL import Image

        from warpjld.render.text import write

        height, width = picture.shape[:2]
        size, bar_width, strip = _bar(height)
        bar_height, left, top = round(0.5 * height), width - strip, round(0.25 * height)
        canvas = Image.fromarray(picture.copy())
        ramp = self.table()[np.rint(np.linspace(255, 0, bar_height)).astype(int)]
        canvas.paste(Image.fromarray(np.repeat(ramp[:, None], bar_width, axis=1)), (left, top))
        for number in self.ticks(apart=1.3 * size / bar_height):
            y = top + bar_height * (1.0 - float(self.shares(np.array([number]))[0]))
            shown = number * self.factor
            text = f"{shown:.3g}" if abs(shown) < 1e3 else f"{shown:.0f}"  # the built-in font has no minus sign
            write(canvas, (left + bar_width + 0.5 * size, y), text, size=size, color=ink, anchor="lm")
        if self.title:
            write(canvas, (width - 0.8 * size, top - 1.4 * size), self.title, size=size, color=ink, anchor="rm")
        return np.asarray(canvas)

    @staticmethod
    def room_beside(size: tuple[int, int]) -> tuple[int, int]:
        """Width and height in the middle of a picture of this size that the bar does not cover."""
        width, height = size
        return max(width - 2 * (_bar(height)[2] + _bar(height)[0]), width // 2), height

    def ticks(self, apart: float = 0.0) -> NDArray[np.float64]:
        """Numbers to write beside the bar: four to eight round ones; with ``highest`` also ``high``. With a power, 1, 2
        and 5 times powers of ten above ``low``, as many as there is room for.

        Args:
            apart: Share of the bar within which other numbers near ``high`` are left out then; with a power, least
                distance of any two.
        """
        if self.power != 1.0:
            return self._spread_ticks(max(apart, _APART))
        low, high = sorted((self.low * self.factor, self.high * self.factor))
        rough = (high - low) / 7.0
        power = 10.0 ** np.floor(np.log10(rough))
        step = power * next(n for n in (1.0, 2.0, 2.5, 5.0, 10.0) if n * power >= rough * (1.0 - 1e-9))
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        numbers = (step * np.arange(first, last + 1) + 0.0) / self.factor
        if self.highest:
            numbers = np.append(numbers[self.shares(numbers) < 1.0 - max(apart, 1e-9)], self.high)
        return np.asarray(numbers)

    def _spread_ticks(self, apart: float) -> NDArray[np.float64]:
        """Ticks of a scale with a power, at least ``apart`` of the bar from one another; the higher ones first."""
        span = self.high - self.low
        top = int(np.floor(np.log10(span * self.factor)))
        rounds = [n * 10.0**power / self.factor for power in range(top, top - _DECADES, -1) for n in (5.0, 2.0, 1.0)]
        kept = [span] if self.highest else []
        for number in (number for number in rounds if number <= span):
            at = self.shares(self.low + np.array([number, 0.0, *kept]))
            if np.abs(at[1:] - at[0]).min() >= apart:
                kept.append(number)
        return np.asarray(self.low + np.array([0.0, *kept[::-1]]))

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
