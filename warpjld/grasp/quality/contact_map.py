"""Contact map: signed distance and contact of every vertex of the skin and of the object, with the part in contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.objects import Places
from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["ContactMap", "contact_map"]

_FAR = 0.01  # distances beyond this are reported as infinite [m]


@dataclass(frozen=True, eq=False)
class ContactMap:
    """Result of `contact_map` for V vertices of the skin and n of the object.

    Attributes:
        skin_distance: Signed distance of skin vertices to the object [m], negative inside, infinite beyond 1 cm, (V,).
        skin_contact: Whether each skin vertex is in contact, shape (V,).
        skin_part: Part of the hand that each skin vertex belongs to, -1 for none, shape (V,).
        object_distance: Signed distance of the object's vertices to the skin [m], likewise, shape (n,).
        object_contact: Whether each of the object's vertices is in contact, shape (n,).
        object_part: Part of the hand nearest to each of the object's vertices in contact, else -1, shape (n,).
    """

    skin_distance: NDArray[np.float64]
    skin_contact: NDArray[np.bool_]
    skin_part: NDArray[np.int64]
    object_distance: NDArray[np.float64]
    object_contact: NDArray[np.bool_]
    object_part: NDArray[np.int64]


def contact_map(
    both: HandObjectGaps, vertices: NDArray[np.floating], parts: NDArray[np.int64], *, tolerance: float
) -> ContactMap:
    """Signed distances d by vertex in both directions, and the vertices in contact: d ≤ tolerance.

    A vertex of the object gets the part of the majority of the corners of the nearest skin triangle.

    Args:
        both: Distances between hand and object, which is at its own placement.
        vertices: The deformed skin [m], shape (V, 3).
        parts: Part of the hand of every vertex, shape (V,); -1 for none.
        tolerance: Largest distance that counts as contact [m], 1 cm at most.

    Raises:
        InputError: Shapes that do not fit, or a tolerance outside that range.
    """
    if len(parts) != len(vertices):
        raise InputError(f"parts: want {len(vertices)}, one a vertex, got {len(parts)}")
    if not 0.0 <= tolerance <= _FAR:
        raise InputError(f"tolerance: want a distance from 0 to {_FAR:g} m, got {tolerance!r}")
    local = both.thing.place.to_local(vertices)[0]
    to_thing = both.near.near(local, _FAR).distance.astype(np.float64)
    to_thing[to_thing > _FAR] = np.inf
    posed = kept_with(both.covering, PosedSkins)
    to_skin, face = posed.distances(posed.fitted(local[None], Places.of()), both.thing.vertices, _FAR)
    faces = both.covering.surface.faces
    touched = (to_skin <= tolerance) & (face >= 0) & (face < len(faces))
    corners = parts[faces[np.where(touched, face, 0)]]
    # majority of three corners, else the first
    part = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    return ContactMap(
        to_thing, to_thing <= tolerance, parts.copy(), to_skin, to_skin <= tolerance, np.where(touched, part, -1)
    )
