"""Perspective camera with named views of a hand or a body, framed once for all frames of a film."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.suggest import one_of

__all__ = ["VIEWS", "Camera"]

#: Eye direction and upward direction of a view in the axes (thumb side, up, forward).
VIEWS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "palmar": ((0, 0, 1), (0, 1, 0)),
    "dorsal": ((0, 0, -1), (0, 1, 0)),
    "radial": ((1, 0, 0), (0, 1, 0)),
    "ulnar": ((-1, 0, 0), (0, 1, 0)),
    "tips": ((0, 1, 0), (0, 0, -1)),
    "three-quarter": ((0.62, 0.22, 0.75), (0, 1, 0)),
    "three-quarter-back": ((0.62, 0.22, -0.75), (0, 1, 0)),
    "front": ((0, 0, 1), (0, 1, 0)),
    "back": ((0, 0, -1), (0, 1, 0)),
    "left": ((1, 0, 0), (0, 1, 0)),
    "right": ((-1, 0, 0), (0, 1, 0)),
    "top": ((0, 1, 0), (0, 0, -1)),
}

_BODY = frozenset({"front", "back", "left", "right", "top"})


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Attributes:
        position: Position of the eye [m].
        target: Point at the centre of the picture [m].
        up: Direction that points up in the picture.
        angle: Vertical field of view [rad]; small angles distort little.
        zoom: Magnification of the picture's content.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    angle: float = math.radians(24)
    zoom: float = 1.0

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            value = np.asarray(getattr(self, name), float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise InputError(f"camera {name}: want three finite numbers, got {getattr(self, name)}")
            object.__setattr__(self, name, tuple(value.tolist()))
        sight = np.subtract(self.target, self.position)
        if np.linalg.norm(np.cross(sight, self.up)) < 1e-9 * np.linalg.norm(sight) * np.linalg.norm(self.up) + 1e-300:
            raise InputError("camera: up must not point along the line of sight, nor position be the target")
        if not 0 < self.angle < math.pi:
            raise InputError(f"camera angle: want radians between 0 and π, got {self.angle}")
        if not (math.isfinite(self.zoom) and self.zoom > 0):
            raise InputError(f"camera zoom: want a number above 0, got {self.zoom}")

    @classmethod
    def view(
        cls,
        name: str,
        points: ArrayLike,
        *,
        forward: ArrayLike = (0.0, 0.0, 1.0),
        up: ArrayLike = (0.0, 1.0, 0.0),
        side: Literal["left", "right"] | None = None,
        size: tuple[int, int] = (960, 720),
        zoom: float = 1.0,
        margin: float = 0.06,
        angle: float = math.radians(24),
    ) -> Self:
        """A named view that shows all points.

        Args:
            name: A key of `VIEWS`: palmar, dorsal, radial, ulnar, tips and three-quarter for hands; front, back,
                left, right (the subject's own) and top for bodies.
            points: Points that must be visible [m], shape (…, 3). Pass the vertices of all frames of a film (or the
                corners of their bounding box), so that the view does not change between frames.
            forward: Direction that the palm, or the face of a body, faces.
            up: From the wrist to the fingers, or from the feet to the head; made perpendicular to ``forward``.
            side: Which hand it is, which determines the thumb's side.
            size: Width and height of the picture, for its aspect ratio.
            zoom: Magnification; above 1 the view is cropped.
            margin: Empty border, as a share of the picture.
            angle: Vertical field of view [rad].

        Raises:
            InputError: Unknown name, no points, or axes that are parallel.
        """
        if name not in VIEWS:
            raise InputError(f"no view '{name}'{one_of(name, VIEWS)}")
        cloud = np.asarray(points, np.float64).reshape(-1, 3)
        if len(cloud) == 0 or not np.isfinite(cloud).all():
            raise InputError("camera points: want at least one point, all finite")
        axes = _axes(forward, up, None if name in _BODY else side)
        eye, above = (np.asarray(direction, float) @ axes for direction in VIEWS[name])
        back = unit(eye)
        right = unit(np.cross(above, back))
        frame = np.stack([right, np.cross(back, right), back])

        local = cloud @ frame.T
        centre = (local.min(axis=0) + local.max(axis=0)) / 2
        local -= centre
        half = np.tan(angle / 2) * (1 - 2 * margin) * np.array([size[0] / size[1], 1.0])
        # a point at depth z is inside the picture when |x| ≤ (distance − z) tan(angle/2)
        distance = float((np.abs(local[:, :2]) / half + local[:, 2:]).max())
        distance = max(distance, float(local[:, 2].max()) + 1e-3)
        target = centre @ frame
        return cls(tuple(target + distance * back), tuple(target), tuple(frame[1]), angle, zoom)

    def closer(self, zoom: float) -> Self:
        """The same camera with its picture enlarged."""
        return replace(self, zoom=self.zoom * zoom)

    def turned(self, angle: float) -> Self:
        """The camera rotated about its target around ``up`` by an angle [rad], for turntables."""
        axis = unit(self.up)
        arm = np.subtract(self.position, self.target)
        arm = (
            arm * math.cos(angle) + np.cross(axis, arm) * math.sin(angle) + axis * (axis @ arm) * (1 - math.cos(angle))
        )
        return replace(self, position=tuple(np.add(self.target, arm)))


def _axes(forward: ArrayLike, up: ArrayLike, side: str | None) -> NDArray[np.float64]:
    """Orthonormal axes as rows: towards the thumb (to the viewer's right for bodies), up, forward."""
    front, above = np.array(forward, float), np.array(up, float)
    front /= max(float(np.linalg.norm(front)), 1e-300)
    above = above - (above @ front) * front
    if not np.linalg.norm(above) > 1e-9:
        raise InputError("camera: forward and up must be two different directions")
    above = unit(above)
    # seen from the palm with its fingers up, a left hand has its thumb on the left
    thumb = np.cross(above, front) * (-1 if side == "left" else 1)
    return np.stack([thumb, above, front])
