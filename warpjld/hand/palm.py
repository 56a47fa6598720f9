"""Implicit surface of the palm, the wrist and the stub of the forearm: a slab with splines as outline and faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from warpjld.hand.sweep import section_distance

__all__ = ["PalmSlab"]

Array = NDArray[np.float64]

# rows of distal coordinate, radial edge, ulnar edge, dorsal face, palmar face [mm of the design hand], squareness
_OUTLINE = np.array(
    [
        (-56, 31.5, -31.0, 20.0, -19.5, 0.06),
        (-40, 30.5, -30.0, 19.4, -18.8, 0.08),
        (-20, 28.8, -28.5, 18.0, -16.8, 0.12),
        (-5, 28.0, -28.0, 16.7, -15.0, 0.20),
        (10, 28.8, -32.0, 15.8, -14.5, 0.32),
        (25, 30.0, -39.0, 15.0, -14.0, 0.45),
        (45, 33.5, -44.0, 13.5, -12.0, 0.50),
        (65, 36.8, -45.5, 12.0, -11.5, 0.50),
        (80, 37.6, -44.5, 10.2, -12.5, 0.50),
        (92, 35.5, -41.5, 6.0, -12.5, 0.50),
        (108, 33.0, -38.5, -1.5, -11.5, 0.50),
        (125, 31.0, -36.0, -6.0, -10.0, 0.50),
    ]
)
# rows of radial coordinate and distal end of the webs [mm of the design hand]
_WEBS = np.array([(-60, 82.0), (-44, 86.0), (-27, 96.0), (-7, 106.0), (15, 107.5), (36, 103.0), (50, 98.0)])
_CAP = 19.0  # length over which the slab is rounded off towards the webs
_STUB = (-52.0, -42.0)  # distal coordinates of the forearm's end, and where its rounding begins
# Gaussian bumps of the palmar and of the dorsal face: radial and distal position, their standard deviations, height
_PADS = (
    (-25.0, 17.0, 14.0, 14.0, -4.0),  # hypothenar: heel
    (-28.0, 42.0, 13.0, 23.0, -4.5),  # and edge of the hand
    (14.0, 19.0, 13.0, 14.0, -6.5),  # thenar
    (-5.0, 60.0, 17.0, 19.0, 3.0),  # hollow
)
_BONES = (
    (-19.0, -12.0, 8.0, 9.0, 2.2),  # head of the ulna
    (3.0, 56.0, 5.0, 26.0, 0.9),  # extensor tendons
    (19.0, 56.0, 5.0, 24.0, 0.6),
    (-13.0, 52.0, 5.0, 24.0, 0.6),
)
_ARCH = (0.006, 0.0045)  # curvature of the dorsal face on the radial and on the ulnar side


@dataclass(frozen=True, eq=False)
class PalmSlab:
    """Signed distance of the slab; ``stretch`` are scales of the design's axes, shape (3,)."""

    stretch: Array

    @property
    def corners(self) -> tuple[Array, Array]:
        """Two opposite corners of the slab's box [mm]."""
        low, high = _OUTLINE.min(axis=0), _OUTLINE.max(axis=0)
        web = float(_WEBS[:, 1].max())
        return (
            np.array([low[2], low[4], -web]) * self.stretch,
            np.array([high[1], high[3], -_STUB[0]]) * self.stretch,
        )

    def __call__(self, points: Array) -> Array:
        """Signed distance of points (n, 3) [mm], negative inside, shape (n,)."""
        x, y, d = (points / self.stretch * (1.0, 1.0, -1.0)).T
        low, high = _OUTLINE[0, 0], _OUTLINE[-1, 0]
        place = np.clip((d - low) * ((len(_TABLE) - 1) / (high - low)), 0.0, len(_TABLE) - 1.001)
        row = place.astype(np.int64)
        part = (place - row)[:, None]
        radial, ulnar, top, bottom, square = ((1.0 - part) * _TABLE[row] + part * _TABLE[row + 1]).T
        for px, pd, sx, sd, height in _PADS:
            bottom = bottom + height * np.exp(-0.5 * (((x - px) / sx) ** 2 + ((d - pd) / sd) ** 2))
        for px, pd, sx, sd, height in _BONES:
            top = top + height * np.exp(-0.5 * (((x - px) / sx) ** 2 + ((d - pd) / sd) ** 2))
        # transverse arch of the knuckles: the dorsal face falls to both sides, more to the ulnar one
        rise = np.clip(d / 70.0, 0.0, 1.0)
        top = top - rise * rise * (3.0 - 2.0 * rise) * (
            _ARCH[0] * np.clip(x - 18.0, 0.0, 20.0) ** 2 + _ARCH[1] * np.clip(-8.0 - x, 0.0, 38.0) ** 2
        )
        top = np.maximum(top, bottom + 8.0)
        web = _WEB_LINE(np.clip(x, -60.0, 50.0))
        beyond = np.maximum(d - (web - _CAP), 0.0) / _CAP + np.maximum(_STUB[1] - d, 0.0) / (_STUB[1] - _STUB[0])
        across, along = self.stretch[0], self.stretch[2]
        return section_distance(
            (x - 0.5 * (radial + ulnar)) * across,
            (y - 0.5 * (top + bottom)) * across,
            beyond,
            0.5 * (radial - ulnar) * across,
            0.5 * (top - bottom) * across,
            np.where(d > 0.0, _CAP, _STUB[1] - _STUB[0]) * along,
            square,
        )


_TABLE = CubicSpline(_OUTLINE[:, 0], _OUTLINE[:, 1:], bc_type="natural")(
    np.linspace(_OUTLINE[0, 0], _OUTLINE[-1, 0], 512)
)
_WEB_LINE = CubicSpline(_WEBS[:, 0], _WEBS[:, 1], bc_type="natural")
