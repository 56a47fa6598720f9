"""Contact by vertex, of the skin and of the object, with the part of the hand that touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.kept import kept_with
from warpjld.grasp.objects import Places
from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["ContactMap", "contact_map"]

_FAR = 0.01  # distances beyond this are not told [m]


@dataclass(frozen=True, eq=False)
class ContactMap:
    """Answer of `contact_map`. V vertices of the skin, n of the object.

    Attributes:
        skin_distance: Signed distance to the object [m], negative inside, infinite beyond 1 cm, shape (V,).
        skin_contact: Whether it is in contact, shape (V,).
        skin_part: Part of the hand it belongs to, shape (V,); -1 for none.
        object_distance: Signed distance to the skin [m], likewise, shape (n,).
        object_contact: Whether it is in contact, shape (n,).
        object_part: Part of the hand whose skin is nearest to it, where it is in contact, else -1, shape (n,).
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
    """Signed distances by vertex, both ways, and what is in contact: d ≤ tolerance.

    An object's vertex belongs to the part that most of the nearest skin triangle's corners do.

    Args:
        both: Hand and object, which is at its own place.
        vertices: The deformed skin [m], shape (V, 3).
        parts: Part of the hand of every vertex, shape (V,); -1 for none.
        tolerance: Largest distance that counts as contact [m], 1 cm at most.

    Raises:
        InputError: Shapes that do not fit, or such a tolerance.
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
    # of three corners two that agree, else the first
    part = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    return ContactMap(
        to_thing, to_thing <= tolerance, parts.copy(), to_skin, to_skin <= tolerance, np.where(touched, part, -1)
    )
