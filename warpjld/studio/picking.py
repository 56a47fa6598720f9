"""Picking: ray intersection with the drawn surfaces, and the joint that moves the skin at the hit vertex."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.geometry.ray import ray_hit
from warpjld.geometry.segment_distance import segment_distance
from warpjld.script.scene import Actor
from warpjld.studio.surfaces import Shown

__all__ = ["digit_of", "first_hit", "joint_at"]


def first_hit(shown: Sequence[Shown], origin: ArrayLike, direction: ArrayLike) -> tuple[Shown, int] | None:
    """First surface that a ray hits, and the hit triangle's corner nearest to the hit point; None without a hit.

    Args:
        shown: Surfaces.
        origin: Origin of the ray [m], shape (3,).
        direction: Direction of the ray, of any length, shape (3,).
    """
    best: tuple[float, Shown, int] | None = None
    for surface in shown:
        found = _hit(surface, np.asarray(origin, np.float64), np.asarray(direction, np.float64))
        if found is not None and (best is None or found[0] < best[0]):
            best = found[0], surface, found[1]
    return None if best is None else best[1:]


def joint_at(actor: Actor, vertex: int) -> str | None:
    """Name of the joint that moves the skin at a vertex; None if the actor is not bound yet.

    It is the proximal joint of the nearest segment in the domain with the largest weight, or the nearest of its
    ancestors that can move.
    """
    covering = actor.covering
    if covering is None or vertex >= len(covering.domains):
        return None
    skeleton, place = actor.skeleton, covering.surface.vertices[vertex]
    segments = covering.fans[int(covering.domains[vertex].argmax())].segments
    distances = [segment_distance(place[None], skeleton.rest, [(s.proximal, s.distal)])[0] for s in segments]
    joint = segments[int(np.argmin(distances))].proximal
    while joint >= 0:
        if (skeleton.limits[joint, :, 0] < skeleton.limits[joint, :, 1]).any():
            return skeleton.names[joint]
        joint = int(skeleton.parents[joint])
    return None


def digit_of(joint: str) -> str | None:
    """Digit that a joint belongs to, such as ``index``; None if it belongs to none."""
    parts = joint.split(".")
    return parts[1] if len(parts) == 3 else None


def _hit(surface: Shown, origin: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, int] | None:
    """Ray parameter of the first hit, and the vertex nearest to it; None without a hit."""
    corners = surface.vertices.astype(np.float64)[surface.faces]
    found = ray_hit(corners, origin, direction)
    if found is None:
        return None
    t, face = found
    corner = int(np.linalg.norm(corners[face] - (origin + t * direction), axis=1).argmin())
    return t, int(surface.faces[face, corner])
