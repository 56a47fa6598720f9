"""Modelled objects: surfaces of revolution, sweeps along paths, and soft objects (metaballs) (A3, B3.1).

Examples:
    >>> from warpjld.grasp.modelled import revolved
    >>> revolved([(0, 0), (0.04, 0), (0.05, 0.03), (0.046, 0.03), (0.037, 0.004), (0, 0.004)], name="dish")
    GraspObject('dish': ... facets, 0.1 × 0.03 × 0.1 m)
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.grasp.objects import GraspObject, make_object

__all__ = ["revolved", "soft", "swept"]

_EDGE = 0.004
"""Edge length on straight parts [m]."""
_MOST = 64
"""Largest number of edges along a straight part."""
_CELLS = 56
"""Cells of a soft object's grid along its longest side."""
_SAME = 1e-9
"""Distance below which points of a profile or a path are the same [m]."""


def revolved(profile: ArrayLike, *, segments: int = 96, name: str = "revolved") -> GraspObject:
    """Surface of revolution about Y.

    A profile that begins or ends off the axis is closed by a disc; a closed profile makes a ring.

    Args:
        profile: Distances from the axis, 0 or more, and heights [m], shape (n, 2). Closed if first and last point are
            the same.
        segments: Number of segments around the axis, 3 … 2048.
        name: Name for messages.

    Raises:
        InputError: A profile that encloses nothing, crosses itself, or crosses the axis.
    """
    points = _profile(profile, name)
    if not 3 <= segments <= 2048:
        raise InputError(f"segments: want 3 to 2048, got {segments}")
    if (points[:, 0] < 0.0).any():
        raise InputError(f"{name}: distances from the axis must be 0 or more, got {points[:, 0].min():g} m")
    closed = bool(np.linalg.norm(points[0] - points[-1]) < _SAME)
    if not closed:
        ends = [[(0.0, height)] if radius > _SAME else np.empty((0, 2)) for radius, height in points[[0, -1]]]
        points = np.concatenate([ends[0], points, ends[1]])
    _refuse_crossing(points, name)
    rows = _finer(points)
    if closed:
        rows = rows[:-1]
    angle = 2.0 * np.pi * np.arange(segments) / segments
    turned = np.empty((len(rows), segments, 3))
    turned[..., 0], turned[..., 2] = rows[:, :1] * np.cos(angle), -rows[:, :1] * np.sin(angle)
    turned[..., 1] = rows[:, 1:]
    number = np.arange(len(rows) * segments).reshape(len(rows), segments)
    number[rows[:, 0] <= _SAME] = number[rows[:, 0] <= _SAME, :1]  # on the axis all are one
    return _made(name, "revolve", turned.reshape(-1, 3), _grid_faces(number, closed), [])


def swept(profile: ArrayLike, path: ArrayLike, *, name: str = "swept") -> GraspObject:
    """Sweep of a closed outline along a path; at the beginning the outline's second axis is as near to Y as possible.

    Args:
        profile: Corners of the outline [m], shape (n, 2), n ≥ 3.
        path: Points on the path [m], shape (m, 3), m ≥ 2, joined by a cubic spline where there are more than two.
            Closed if first and last point are the same.
        name: Name for messages.

    Raises:
        InputError: An outline that encloses nothing or crosses itself, or a path without length.
    """
    points = _profile(profile, name)
    if np.linalg.norm(points[0] - points[-1]) < _SAME:
        points = points[:-1]
    if len(points) < 3:
        raise InputError(f"{name}: an outline needs three points or more, got {len(points)}")
    loop = np.concatenate([points, points[:1]])
    _refuse_crossing(loop, name)
    rows = _finer(loop)[:-1]
    line, closed = _path(path, name)
    across, up = _frames(line, closed)
    places = line[:, None] + rows[:, 0, None] * across[:, None] + rows[:, 1, None] * up[:, None]
    number = np.arange(places[..., 0].size).reshape(places.shape[:2])
    if closed:
        return _made(name, "sweep", places.reshape(-1, 3), _grid_faces(number, True), [])
    lid = _lid(rows)
    return _made(
        name, "sweep", places.reshape(-1, 3), _grid_faces(number, False), [number[0][lid[:, ::-1]], number[-1][lid]]
    )


def soft(centres: ArrayLike, radii: ArrayLike, *, name: str = "soft") -> GraspObject:
    """Soft object: the level set Σ w(|x − c| / 2r) = ½ of a field around key points; a single one gives a ball.

    w(s) = 1 − 22/9 s² + 17/9 s⁴ − 4/9 s⁶ up to s = 1, nothing beyond (G. Wyvill, C. McPheeters, B. Wyvill 1986, Data
    structure for soft objects, The Visual Computer 2, 227–234); polygonised by VTK.

    Args:
        centres: Key points [m], shape (k, 3).
        radii: Radius of the ball around each [m], shape (k,).
        name: Name for messages.

    Raises:
        InputError: Wrong shapes, or radii that are not positive.
    """
    import pyvista

    at, size = np.asarray(centres, np.float64), np.asarray(radii, np.float64)
    if at.ndim != 2 or at.shape[1:] != (3,) or size.shape != at.shape[:1] or not len(at):
        raise InputError(f"{name}: want key points (k, 3) and a radius for each, got {at.shape} and {size.shape}")
    if not (np.isfinite(at).all() and (size > 0.0).all() and np.isfinite(size).all()):
        raise InputError(f"{name}: want finite key points, and radii above 0 m")
    low, high = (at - 2.0 * size[:, None]).min(axis=0), (at + 2.0 * size[:, None]).max(axis=0)
    cell = min(float((high - low).max()) / _CELLS, float(size.min()) / 4.0)
    count = np.ceil((high - low) / cell).astype(int) + 1
    if count.prod() > 4e6:
        raise InputError(f"{name}: radii of {size.min():g} m are too small for an object of {(high - low).max():g} m")
    grid = pyvista.ImageData(dimensions=count, spacing=(cell, cell, cell), origin=low)
    field = np.zeros(grid.n_points)
    for centre, radius in zip(at, size, strict=True):
        share = np.minimum(((grid.points - centre) ** 2).sum(axis=1) / (2.0 * radius) ** 2, 1.0)
        field += 1.0 - share * (22.0 - share * (17.0 - 4.0 * share)) / 9.0
    found = grid.contour([0.5], field, method="flying_edges")
    return _made(name, "soft", np.asarray(found.points, np.float64), found.regular_faces, [])


def _profile(profile: ArrayLike, name: str) -> NDArray[np.float64]:
    """Points of a profile (n, 2) without consecutive duplicates.

    Raises:
        InputError: Wrong shape, not finite, or fewer than two different points.
    """
    points = np.asarray(profile, np.float64)
    if points.ndim != 2 or points.shape[1:] != (2,) or not np.isfinite(points).all():
        raise InputError(f"{name}: a profile needs points of two finite numbers each, got {points.shape}")
    points = points[np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > _SAME)]
    if len(points) < 2:
        raise InputError(f"{name}: a profile needs two points or more that differ, got {len(points)}")
    return points


def _refuse_crossing(line: NDArray[np.float64], name: str) -> None:
    """Refuse a polyline (n, 2) that crosses itself.

    Raises:
        InputError: Names the two segments that cross.
    """
    a, b = line[:-1], line[1:]

    def side(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    row, column = (a[:, None], b[:, None]), (a[None], b[None])
    crossing = side(*row, column[0]) * side(*row, column[1]) < 0.0
    crossing &= side(*column, row[0]) * side(*column, row[1]) < 0.0
    if crossing.any():
        k, m = np.argwhere(crossing)[0]
        raise InputError(f"{name}: the profile crosses itself, between its points {k + 1} and {m + 1}")


def _finer(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Subdivide a polyline (n, d) into edges of about ``_EDGE``."""
    rows = [line[:1]]
    for start, end in itertools.pairwise(line):
        pieces = int(np.clip(round(float(np.linalg.norm(end - start)) / _EDGE), 1, _MOST))
        rows.append(start + (end - start) * (np.arange(1, pieces + 1) / pieces)[:, None])
    return np.concatenate(rows)


def _path(path: ArrayLike, name: str) -> tuple[NDArray[np.float64], bool]:
    """Points along a path (n, 3), and whether it is closed; a closed one does not repeat its first point."""
    from scipy.interpolate import CubicSpline

    points = np.asarray(path, np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise InputError(f"{name}: a path needs points of three finite numbers each, got {points.shape}")
    points = points[np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > _SAME)]
    if len(points) < 2:
        raise InputError(f"{name}: a path needs two points or more that differ, got {len(points)}")
    closed = len(points) > 3 and bool(np.linalg.norm(points[0] - points[-1]) < _SAME)
    if len(points) == 2:
        return _finer(points), False
    if closed:
        points[-1] = points[0]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    count = int(np.clip(round(float(along[-1]) / _EDGE), 2 * len(points), 8 * _MOST))
    spline = CubicSpline(along, points, bc_type="periodic" if closed else "natural")
    return np.asarray(spline(np.linspace(0.0, along[-1], count + 1)[: count if closed else None])), closed


def _frames(line: NDArray[np.float64], closed: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation-minimising frame along a path: two unit vectors normal to it at every point, each (n, 3).

    The remaining twist of a closed path is distributed evenly.
    """
    from scipy.spatial.transform import Rotation

    around = np.concatenate([line[-1:], line, line[:1]]) if closed else line
    ways = unit(np.diff(around, axis=0))
    tangent = (
        unit(ways[:-1] + ways[1:]) if closed else unit(np.concatenate([ways[:1], ways[:-1] + ways[1:], ways[-1:]]))
    )
    above = np.array([0.0, 1.0, 0.0]) if abs(tangent[0, 1]) < 0.99 else np.array([0.0, 0.0, 1.0])
    up = [unit(above - (above @ tangent[0]) * tangent[0])]
    for way in tangent[1:]:
        up.append(unit(up[-1] - (up[-1] @ way) * way))
    ups = np.array(up)
    if closed:
        last = unit(ups[-1] - (ups[-1] @ tangent[0]) * tangent[0])
        twist = np.arctan2(np.cross(last, ups[0]) @ tangent[0], last @ ups[0])
        share = np.arange(len(ups)) / len(ups)
        ups = Rotation.from_rotvec(twist * share[:, None] * tangent).apply(ups)
    return np.cross(ups, tangent), ups


def _lid(outline: NDArray[np.float64]) -> NDArray[np.int64]:
    """Triangulation of an outline (n, 2), which may be concave."""
    import pyvista

    flat = np.column_stack([outline, np.zeros(len(outline))])
    polygon = pyvista.PolyData(flat, faces=[len(flat), *range(len(flat))])
    return np.asarray(polygon.triangulate().regular_faces, np.int64)


def _grid_faces(number: NDArray[np.int64], closed: bool) -> NDArray[np.int64]:
    """Triangles between rings of points with indices (rings, around); degenerate ones are left out."""
    rings = np.concatenate([number, number[:1]]) if closed else number
    after = np.roll(rings, -1, axis=1)
    a, b, c, d = rings[:-1], after[:-1], after[1:], rings[1:]
    faces = np.concatenate([np.stack(abc, axis=-1).reshape(-1, 3) for abc in ((a, b, c), (a, c, d))])
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return faces[proper]


def _made(
    name: str, origin: str, points: NDArray[np.float64], faces: NDArray, lids: list[NDArray[np.int64]]
) -> GraspObject:
    """Object from points and triangles, oriented outwards.

    Raises:
        InputError: It encloses no volume.
    """
    triangles = np.concatenate([np.asarray(faces, np.int64), *lids])
    if not len(triangles):
        raise InputError(f"{name}: it encloses nothing")
    used, triangles = np.unique(triangles, return_inverse=True)
    points, triangles = points[used], triangles.reshape(-1, 3)
    corners = points[triangles] - points.mean(axis=0)
    volume = float(np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0
    if abs(volume) < 1e-6 * float(np.ptp(points, axis=0).max()) ** 3:
        raise InputError(f"{name}: it encloses nothing")
    if volume < 0.0:
        triangles = triangles[:, ::-1]
    return make_object(name, points, triangles, origin=origin)
