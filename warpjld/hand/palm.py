"""The palm, the wrist and the stub of the forearm: a slab whose outline and two faces are functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from warpjld.hand.sweep import section_distance

__all__ = ["Palm"]

Array = NDArray[np.float64]

# distal place: radial edge, ulnar edge, dorsal face, palmar face, squareness [mm of the design hand]
_OUTLINE = np.array(
    [
        (-56, 30.0, -29.5, 19.0, -18.5, 0.10),
        (-40, 29.5, -29.0, 18.7, -18.2, 0.12),
        (-20, 28.5, -28.0, 18.0, -17.0, 0.18),
        (-5, 28.0, -28.0, 17.0, -16.0, 0.25),
        (10, 28.5, -31.5, 16.0, -15.5, 0.35),
        (25, 30.0, -37.5, 15.0, -14.0, 0.45),
        (45, 33.5, -43.0, 13.5, -12.0, 0.50),
        (65, 37.0, -45.5, 12.0, -11.5, 0.50),
        (80, 38.0, -46.0, 10.0, -12.5, 0.50),
        (92, 37.5, -45.5, 6.0, -12.5, 0.50),
        (108, 36.0, -44.0, -1.5, -11.5, 0.50),
        (125, 34.0, -42.0, -6.0, -10.0, 0.50),
    ]
)
# where the webs end, by radial place
_WEBS = np.array([(-60, 82.0), (-44, 87.0), (-27, 97.0), (-7, 106.5), (15, 108.0), (36, 105.0), (50, 100.0)])
_CAP = 18.0  # length over which the slab closes towards the webs
_STUB = (-52.0, -42.0)  # end of the forearm, and where its rounding begins
# lumps of the palmar face: radial and distal place, their spreads, height
_PADS = (
    (-27.0, 24.0, 11.0, 19.0, -7.0),  # hypothenar
    (17.0, 22.0, 12.0, 16.0, -5.0),  # thenar
    (-4.0, 58.0, 17.0, 18.0, 2.0),  # hollow
)


@dataclass(frozen=True, eq=False)
class Palm:
    """Signed distance of the slab; ``stretch`` scales the design's axes."""

    stretch: Array

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
