"""Ray casting and cross-sections of a surface around a point of the skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit

__all__ = ["CrossSection", "cross_section", "first_hits", "nearby", "skin_hits"]

_SAME = 1e-9  # distance of two crossings of a ray at one edge, per size of the surface: rounding
_CHUNK = 2_000_000  # ray–triangle pairs at a time: about 200 MB of temporaries


@dataclass(frozen=True)
class CrossSection:
    """Cross-section of a surface in a plane through a point.

    Attributes:
        centre: Centroid of the section, shape (3,).
        radius: Radius of the circle of the same area.
        seen: Share of the rays that hit the surface: below 1 at open ends.
    """

    centre: NDArray[np.float64]
    radius: float
    seen: float


def nearby(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], centre: NDArray[np.float64], radius: float
) -> NDArray[np.int32]:
    """Faces that may reach within ``radius`` of ``centre``, shape (n, 3)."""
    middle, extent = _spheres(vertices[faces])
    away = middle - centre
    return faces[np.sqrt(np.einsum("tk,tk->t", away, away)) < radius + extent]


def first_hits(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distance along each ray of unit direction to its first triangle (Möller–Trumbore), ``inf`` where there is none,
    shape (R,)."""
    out = np.full(len(origins), np.inf)
    ray, distance, _ = _crossings(vertices, faces, origins, directions)
    np.minimum.at(out, ray, distance)
    return out


def skin_hits(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distance along each ray of unit direction to where it leaves the flesh, ``inf`` without such a place, shape (R,).

    Flesh may consist of pieces that overlap, as a jointed figure's do: it ends where the ray has left all pieces that
    it started in or entered. Rays from outside, or out of an open end, end at their first triangle.
    """
    out = np.full(len(origins), np.inf)
    ray, distance, leaving = _crossings(vertices, faces, origins, directions)
    if not len(ray):
        return out
    order = np.lexsort((leaving, distance, ray))
    ray, distance, leaving = ray[order], distance[order], leaving[order]
    # a ray through an edge crosses the surface once
    again = (np.diff(ray) == 0) & (np.diff(leaving) == 0)
    again &= np.diff(distance) <= _SAME * np.linalg.norm(np.ptp(vertices, axis=0))
    once = np.concatenate([[True], ~again])
    ray, distance, leaving = ray[once], distance[once], leaving[once]
    change = np.where(leaving, -1, 1)
    pieces = -np.bincount(ray, change, len(origins))[ray]  # around the origin: the ray leaves one more than it enters
    balance = np.concatenate([[0], np.cumsum(change)])
    count = pieces + balance[1:] - balance[np.searchsorted(ray, ray)]
    ends = (count <= 0) | (pieces <= 0)
    np.minimum.at(out, ray[ends], distance[ends])
    return out


def _crossings(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
    """All crossings of rays and triangles: ray, distance along it, and whether the ray leaves the flesh there."""
    none = np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0, dtype=bool)
    if not len(faces):
        return none
    corners = vertices[faces]
    middle, extent = _spheres(corners)
    extent *= 1 + 1e-9
    # rays with a common origin share the vectors to the triangles
    apart = slice(None) if (origins != origins[0]).any() else slice(1)
    rows = max(1, _CHUNK // len(faces))
    found = [none]
    for start in range(0, len(origins), rows):
        origin, direction = origins[start : start + rows], directions[start : start + rows]
        # exact tests only for triangles whose bounding sphere the ray meets
        away = middle - origin[apart, None]
        along = (away @ direction[..., None])[..., 0] if len(away) > 1 else direction @ away[0].T
        aside = np.einsum("rtk,rtk->rt", away, away) - along**2
        ray, triangle = np.nonzero((aside <= extent**2) & (along >= -extent))
        distance, leaving = _meet(corners[triangle], origin[ray], direction[ray])
        met = np.isfinite(distance)
        found.append((start + ray[met], distance[met], leaving[met]))
    rays, distances, leavings = (np.concatenate(part) for part in zip(*found, strict=True))
    return rays, distances, leavings


def _spheres(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (T, 3) and radii (T,) of bounding spheres of triangles (T, 3, 3)."""
    middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0
    spokes = corners - middle[:, None]
    return middle, np.sqrt(np.einsum("tnk,tnk->tn", spokes, spokes).max(axis=1))


def _meet(
    corners: NDArray[np.float64], origin: NDArray[np.float64], direction: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Distance along each ray to its triangle, ``inf`` for misses, and whether it meets the triangle's inner side."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        outwards = (edge1 * p).sum(axis=1)
        inverse = 1.0 / outwards
        s = origin - corners[:, 0]
        u = (s * p).sum(axis=1) * inverse
        q = np.cross(s, edge1)
        v = (q * direction).sum(axis=1) * inverse
        t = (q * edge2).sum(axis=1) * inverse
        met = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 1e-9) & np.isfinite(t)
    return np.where(met, t, np.inf), outwards < 0.0


def cross_section(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    point: NDArray[np.float64],
    direction: NDArray[np.float64],
    rays: int = 24,
) -> CrossSection | None:
    """The skin around ``point`` in the plane normal to ``direction``; None if too few rays hit any."""
    across = unit(np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))]))
    angle = np.arange(rays) * (2 * np.pi / rays)
    spokes = np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(direction, across))
    reach = skin_hits(vertices, faces, np.broadcast_to(point, spokes.shape), spokes)
    seen = np.isfinite(reach)
    if seen.mean() < 0.6:
        return None
    x, y = reach[seen] * np.cos(angle[seen]), reach[seen] * np.sin(angle[seen])
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = cross.sum() / 2
    if not area > 0:
        return None
    cx, cy = ((x + np.roll(x, -1)) * cross).sum() / (6 * area), ((y + np.roll(y, -1)) * cross).sum() / (6 * area)
    centre = point + cx * across + cy * np.cross(direction, across)
    return CrossSection(centre, float(np.sqrt(area / np.pi)), float(seen.mean()))
