"""Widest sections of fingers, which mark their middle knuckles on the surface (R14).

The heads of a finger's bones are wider than their shafts: across the flexion axis the flesh is widest at the middle
joint, between the narrowings of proximal and middle phalanx. Fingers without two narrowings (coarse or stylised
surfaces) give no answer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.section import nearby, skin_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["widest_at_knuckles"]

Array = NDArray[np.float64]

_SECTIONS = 41
"""Sections of a finger between the ends below: less than 2 mm apart in an adult's."""
_FROM = 0.3  # first section, as a share of the proximal phalanx: before it lies the web
_SMOOTH = 5  # sections over which widths are averaged: facets are about as long
_PROMINENT = 0.015
"""Smallest prominence of the widest section over the narrower one of its two narrowings, per width: a third of that of
the hands in which the knuckles can be seen (0.04 to 0.2); rounding and facets give less than 0.01."""


def widest_at_knuckles(skeleton: Skeleton, vertices: Array, faces: NDArray[np.int32]) -> dict[str, float]:
    """Distances along each finger from its middle joint to the widest section around it.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).

    Returns:
        Names of middle joints (``left.index.knuckle2``) → distance [m], positive towards the tip. Fingers without such
        a section are left out.
    """
    out = {}
    for side in ("left.", "right.", ""):
        for digit in DIGITS:
            names = [f"{side}{digit}.{joint}" for joint in FINGER_JOINTS]
            if digit == "thumb" or not set(names) <= set(skeleton.names):
                continue
            chain = skeleton.rest[[skeleton.index(name) for name in names]]
            axis = skeleton.axes[skeleton.index(names[1])]
            reach = float(np.linalg.norm(chain[3] - chain[0]))
            near = nearby(vertices, faces, chain[1:3].mean(axis=0), reach)
            found = _widest(chain, axis, vertices, near)
            if found is not None:
                out[names[1]] = found
    return out


def _widest(chain: Array, axis: Array, vertices: Array, faces: NDArray[np.int32]) -> float | None:
    """Distance from the second joint of a chain (4, 3) to the widest section around it; None if there is none."""
    lengths = np.linalg.norm(np.diff(chain, axis=0), axis=1)
    if not lengths.min() > 0.0:
        return None
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(_FROM * ends[1], ends[3], _SECTIONS)
    bone = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, 2)
    ways = np.diff(chain, axis=0) / lengths[:, None]
    places = chain[bone] + (at - ends[bone])[:, None] * ways[bone]
    across = np.array([unit(axis - (axis @ way) * way) for way in ways])[bone]
    rays = np.concatenate([across, -across])
    width = skin_hits(vertices, faces, np.concatenate([places, places]), rays).reshape(2, -1).sum(axis=0)
    if not np.isfinite(width).all():
        return None
    padded = np.pad(width, _SMOOTH // 2, mode="edge")
    width = np.convolve(padded, np.ones(_SMOOTH) / _SMOOTH, mode="valid")
    # between the narrowest sections of the proximal and of the middle phalanx, as far as the latter's half
    inner = np.flatnonzero(at <= ends[2])
    peaks = [k for k in inner[1:-1] if width[k] >= width[k - 1] and width[k] > width[k + 1]]
    if not peaks:
        return None
    best = min(peaks, key=lambda k: abs(float(at[k] - ends[1])))
    low = max(float(width[: best + 1].min()), float(width[best : inner[-1] + 1].min()))
    if width[best] - low < _PROMINENT * width[best]:
        return None
    return float(at[best] - ends[1])
