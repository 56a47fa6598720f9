"""Contact sheet of hand poses: a small labelled picture of each."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.skeleton import CHANNELS, poses_from_angles

__all__ = ["pose_sheet"]

_CELL = (96, 112)  # pixels
_COLUMNS = 4  # pictures side by side
_VERTICES = 1500  # of the hand that is drawn: enough at this size
_SIDE: Literal["left"] = "left"
_PALM, _FINGERS = (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)
"""Directions in which the palm and the fingers of the hand point."""


def pose_sheet(poses: Mapping[str, Mapping[str, float]]) -> NDArray[np.uint8]:
    """Contact sheet of hand poses, labelled with their names, uint8 (height, width, 3).

    Args:
        poses: Poses by name; angles [degrees] by channel name without a side, such as ``index.base.flexion``.
    """
    from PIL import Image, ImageDraw

    from warpjld import render

    covering = _covering()
    angles = np.stack([_angles(covering, pose) for pose in poses.values()])
    vertices = covering.deform(poses_from_angles(covering.skeleton, angles))
    camera = render.Camera.view("palmar", vertices, forward=_PALM, up=_FINGERS, side=_SIDE, size=_CELL)
    cells = []
    with render.SceneRenderer(covering.surface.faces, camera, look="shaded", size=_CELL) as stage:
        for name, points in zip(poses, vertices, strict=True):
            cell = Image.fromarray(stage.draw(points).copy())
            ImageDraw.Draw(cell).text((3, 1), name, fill="#333333")
            cells.append(np.asarray(cell))
    blank = [np.full_like(cells[0], 255)] * (-len(cells) % _COLUMNS)
    cells += blank
    rows = [np.concatenate(cells[k : k + _COLUMNS], axis=1) for k in range(0, len(cells), _COLUMNS)]
    return np.concatenate(rows)


@cache
def _covering() -> Covering:
    from warpjld.covering.kept import bind_kept
    from warpjld.hand import build_hand

    return bind_kept(build_hand(_SIDE, resolution=_VERTICES))[0]


def _angles(covering: Covering, pose: Mapping[str, float]) -> NDArray[np.float64]:
    """Joint angles of a pose, clamped to the limits [rad], shape (J, 4)."""
    skeleton = covering.skeleton
    out = skeleton.initial.copy()
    for channel, degrees in pose.items():
        joint, _, kind = channel.rpartition(".")
        if f"{_SIDE}.{joint}" in skeleton.names:
            place = skeleton.index(f"{_SIDE}.{joint}"), CHANNELS.index(kind)
            out[place] = np.clip(np.radians(degrees), *skeleton.limits[place])
    return out
