"""Ray casting and cross-sections of a surface around a point of the skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit

__all__ = ["CrossSection", "cross_section", "first_hits", "nearby"]

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
    if not len(faces):
        return out
    corners = vertices[faces]
    middle, extent = _spheres(corners)
    extent *= 1 + 1e-9
    # rays with a common origin share the vectors to the triangles
    apart = slice(None) if (origins != origins[0]).any() else slice(1)
    rows = max(1, _CHUNK // len(faces))
    for start in range(0, len(origins), rows):
        origin, direction = origins[start : start + rows], directions[start : start + rows]
        # exact tests only for triangles whose bounding sphere the ray meets
        away = middle - origin[apart, None]
        along = (away @ direction[..., None])[..., 0] if len(away) > 1 else direction @ away[0].T
        aside = np.einsum("rtk,rtk->rt", away, away) - along**2
        ray, triangle = np.nonzero((aside <= extent**2) & (along >= -extent))
        distance = _distances(corners[triangle], origin[ray], direction[ray])
        np.minimum.at(out, start + ray, distance)
    return out


def _spheres(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (T, 3) and radii (T,) of bounding spheres of triangles (T, 3, 3)."""
    middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0
    spokes = corners - middle[:, None]
    return middle, np.sqrt(np.einsum("tnk,tnk->tn", spokes, spokes).max(axis=1))


def _distances(
    corners: NDArray[np.float64], origin: NDArray[np.float64], direction: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance along each ray to its triangle, ``inf`` for misses."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / (p * edge1).sum(axis=1)
        s = origin - corners[:, 0]
        u = (s * p).sum(axis=1) * inverse
        q = np.cross(s, edge1)
        v = (q * direction).sum(axis=1) * inverse
        t = (q * edge2).sum(axis=1) * inverse
        met = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 1e-9) & np.isfinite(t)
    return np.where(met, t, np.inf)


def cross_section(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    point: NDArray[np.float64],
    direction: NDArray[np.float64],
    rays: int = 24,
) -> CrossSection | None:
    """The first surface hit around ``point`` in the plane normal to ``direction``; None if too few rays hit any."""
    across = unit(np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))]))
    angle = np.arange(rays) * (2 * np.pi / rays)
    spokes = np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(direction, across))
    reach = first_hits(vertices, faces, np.broadcast_to(point, spokes.shape), spokes)
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
