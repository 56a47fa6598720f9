"""Penetration of hand and object: depths in both directions, and common volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.intersection import intersection_beside

__all__ = ["Penetration", "penetration"]


@dataclass(frozen=True)
class Penetration:
    """Result of `penetration`.

    Attributes:
        skin: Depth of the deepest skin vertex inside the object [m]; 0 where none is.
        thing: Depth of the object's deepest vertex, or point of a sharp edge, inside the skin [m]; 0 where none is.
        volume: Common volume [m³], by the midpoint rule of `warpjld.grasp.Intersection`.
        spacing: Edge of that grid's cells [m].
    """

    skin: float
    thing: float
    volume: float
    spacing: float

    @property
    def depth(self) -> float:
        """The larger of the two depths [m]."""
        return max(self.skin, self.thing)


def penetration(both: HandObjectGaps, vertices: NDArray[np.floating]) -> Penetration:
    """Penetration of a deformed hand and an object, measured in both directions.

    With d_O the signed distance to the object, d_S that to the skin, negative inside,

        skin = max(0, −min d_O(skin vertices)),   thing = max(0, −min d_S(object's outline)),

    a pointwise depth in both directions (Zhang, Kim, Varadhan & Manocha 2007 compute the exact one). The outline is the
    object's vertices and points of its sharp edges (`warpjld.grasp.outline_points`), so that the edge of a box that
    enters a finger between the finger's vertices is found.

    Args:
        both: Distances between hand and object, which is at its own placement. The hand's skin may be open, as at the
            wrist.
        vertices: The deformed skin [m], shape (V, 3).
    """
    inside = intersection_beside(both.covering, both.thing.place.to_local(vertices)[0], both.near)
    return Penetration(inside.deepest, both.depth_of_object(vertices), inside.volume, inside.spacing)
