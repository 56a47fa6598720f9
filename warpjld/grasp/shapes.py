"""Built-in objects [m], Y up, their origin at the centre of the bounding box.

Examples:
    >>> wj.shapes.glass(0.07, 0.12)  # diameter and height, m
    GraspObject('glass': ... facets, 0.07 × 0.12 × 0.07 m)
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.geometry.box_surface import box_surface
from warpjld.grasp.objects import GraspObject, make_object

__all__ = ["SHAPES", "ball", "box", "cylinder", "glass", "plate"]

_MOST = 24  # largest number of edges along a side of a box, so that large boxes have few triangles
_EDGE = 0.004  # edge length on flat and straight parts [m]


def ball(diameter: float = 0.065, *, subdivisions: int = 4, name: str = "ball") -> GraspObject:
    """A ball: an icosphere, subdivided ``subdivisions`` times (4: 5,120 triangles).

    Args:
        diameter: Diameter [m].
        subdivisions: 0 … 7.
        name: Name for messages.

    Raises:
        InputError: A size or a number out of range.
    """
    _check(diameter=diameter)
    if not 0 <= subdivisions <= 7:
        raise InputError(f"subdivisions: want 0 to 7, got {subdivisions}")
    golden = (1.0 + 5.0**0.5) / 2.0
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-golden, golden)]
    points = np.array([[0, a, b] for a, b in signs] + [[a, b, 0] for a, b in signs] + [[b, 0, a] for a, b in signs])
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    faces = np.array(hull.simplices)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inwards = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inwards] = faces[inwards, ::-1]
    for _ in range(subdivisions):
        points, faces = _split(points / np.linalg.norm(points, axis=1, keepdims=True), faces)
    points *= diameter / 2.0 / np.linalg.norm(points, axis=1, keepdims=True)
    return make_object(name, points, faces, origin="ball")


def box(
    width: float = 0.06, height: float = 0.10, depth: float = 0.04, *, edge: float = _EDGE, name: str = "box"
) -> GraspObject:
    """A box: extent along x, y and z; every side is a grid with edges of about ``edge`` [m]."""
    _check(width=width, height=height, depth=depth, edge=edge)
    size = np.array([width, height, depth])
    steps = [np.linspace(-0.5, 0.5, int(np.clip(round(s / edge), 1, _MOST)) + 1) for s in size]
    points, faces = box_surface(steps)
    return make_object(name, points * size, faces, origin="box")


def cylinder(
    diameter: float = 0.06, height: float = 0.12, *, segments: int = 64, name: str = "cylinder"
) -> GraspObject:
    """An upright cylinder with flat ends."""
    _check(diameter=diameter, height=height)
    r, h = diameter / 2.0, height / 2.0
    return _turned(name, "cylinder", [(0, -h), (r, -h), (r, h), (0, h)], segments)


def plate(
    diameter: float = 0.20, height: float = 0.02, *, thickness: float = 0.004, name: str = "plate"
) -> GraspObject:
    """A plate: a flat bottom, a rising rim with a round edge.

    Raises:
        InputError: A size out of range, or too thick.
    """
    _check(diameter=diameter, height=height, thickness=thickness)
    if thickness > 0.5 * height or thickness > 0.1 * diameter:
        raise InputError(f"thickness: too thick for a plate of {diameter:g} m by {height:g} m, got {thickness:g}")
    r, h, t = diameter / 2.0, height / 2.0, thickness
    foot, edge = 0.6 * r, np.array([r - t / 2.0, h - t / 2.0])
    rise = edge - (foot, -h + t / 2.0)
    across = t / 2.0 * np.array([rise[1], -rise[0]]) / np.linalg.norm(rise)
    turns = np.linspace(0.0, np.pi, 9)
    rim = [tuple(edge + np.cos(a) * across + np.sin(a) * np.array([-across[1], across[0]])) for a in turns]
    return _turned(name, "plate", [(0, -h), (foot, -h), *rim, (foot - t / 2, -h + t), (0, -h + t)], 96)


def glass(
    diameter: float = 0.07, height: float = 0.12, *, thickness: float = 0.003, name: str = "glass"
) -> GraspObject:
    """A tumbler: open above, a thick bottom, narrower below, with a round rim.

    Raises:
        InputError: A size out of range, or too thick.
    """
    _check(diameter=diameter, height=height, thickness=thickness)
    if thickness > 0.2 * diameter or 3.0 * thickness > 0.5 * height:
        raise InputError(f"thickness: too thick for a glass of {diameter:g} m by {height:g} m, got {thickness:g}")
    r, h, t = diameter / 2.0, height / 2.0, thickness
    low = 0.82 * r
    rim = [(r - t / 2 + np.cos(a) * t / 2, h - t / 2 + np.sin(a) * t / 2) for a in np.linspace(0.0, np.pi, 9)]
    return _turned(name, "glass", [(0, -h), (low, -h), *rim, (low - t, -h + 3 * t), (0, -h + 3 * t)], 72)


SHAPES: dict[str, Callable[..., GraspObject]] = {
    "ball": ball,
    "box": box,
    "cylinder": cylinder,
    "plate": plate,
    "glass": glass,
}
"""Built-in objects by name; their positional arguments are their sizes [m]."""


def _turned(name: str, origin: str, profile: list[tuple[float, ...]], segments: int) -> GraspObject:
    """Surface of revolution about Y of a profile (radius, height) [m] from axis to axis, anticlockwise."""
    if not 3 <= segments <= 2048:
        raise InputError(f"segments: want 3 to 2048, got {segments}")
    rows = _subdivided(np.array(profile, dtype=np.float64))
    angle = 2.0 * np.pi * np.arange(segments) / segments
    rings = rows[1:-1]
    around = np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
    points = np.empty((len(rings), segments, 3))
    points[..., 0] = rings[:, :1] * around[:, 0]
    points[..., 1] = rings[:, 1:]
    points[..., 2] = rings[:, :1] * around[:, 1]
    number = np.arange(points[..., 0].size).reshape(len(rings), segments)
    after = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], after[:-1], after[1:], number[1:]
    bottom, top = number.size, number.size + 1
    faces = [
        np.stack([a, b, c], axis=-1).reshape(-1, 3),
        np.stack([a, c, d], axis=-1).reshape(-1, 3),
        np.stack([np.full(segments, bottom), after[0], number[0]], axis=-1),
        np.stack([np.full(segments, top), number[-1], after[-1]], axis=-1),
    ]
    poles = np.array([[0.0, rows[0, 1], 0.0], [0.0, rows[-1, 1], 0.0]])
    return make_object(name, np.concatenate([points.reshape(-1, 3), poles]), np.concatenate(faces), origin=origin)


def _subdivided(profile: NDArray[np.float64]) -> NDArray[np.float64]:
    rows = [profile[:1]]
    for start, end in pairwise(profile):
        pieces = int(np.clip(round(float(np.linalg.norm(end - start)) / _EDGE), 1, 64))
        rows.append(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
    return np.concatenate(rows)


def _split(points: NDArray[np.float64], faces: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """One midpoint subdivision: every triangle becomes four."""
    triangles = np.asarray(faces)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, place = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (len(points) + place.reshape(3, -1)[k] for k in range(3))
    a, b, c = triangles.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    middles = points[unique].mean(axis=1)
    return np.concatenate([points, middles]), np.concatenate([np.stack(q, axis=1) for q in quarters])


def _check(**sizes: float) -> None:
    for name, size in sizes.items():
        if not (np.isfinite(size) and 0.0 < size <= 100.0):
            raise InputError(f"{name}: want metres above 0, up to 100, got {size:g}")
