"""How deep hand and object are inside one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.intersection import intersection
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.outline import outline
from warpjld.grasp.validation import MeshReport

__all__ = ["Penetration", "depth_inside", "penetration"]


@dataclass(frozen=True)
class Penetration:
    """Answer of `penetration`.

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


def penetration(covering: Covering, vertices: NDArray[np.floating], thing: GraspObject) -> Penetration:
    """Penetration of a deformed hand and an object, looked at from both sides.

    With d_O the signed distance to the object, d_S that to the skin, negative inside,

        skin = max(0, −min d_O(skin vertices)),   thing = max(0, −min d_S(object's outline)),

    the two halves of a depth by points (Zhang, Kim, Varadhan & Manocha 2007 compute the exact one), the outline being
    the object's vertices and points of its sharp edges (`warpjld.grasp.outline`): a finger with few vertices does not
    hide the edge of a box that cuts into it.

    Args:
        covering: The hand; its skin may be open, as at the wrist.
        vertices: The deformed skin [m], shape (V, 3).
        thing: The object, at its own place.
    """
    inside = intersection(covering, vertices, thing)
    stage = thing.place.apply(outline(thing))[0]
    return Penetration(
        inside.deepest, depth_inside(stage, vertices, covering.surface.faces), inside.volume, inside.spacing
    )


def depth_inside(points: NDArray[np.floating], vertices: NDArray[np.floating], faces: NDArray[np.int32]) -> float:
    """Depth of the deepest of some points inside a surface, which may be open or pass through itself [m].

    Winding numbers tell inside from outside. 0 where no point is inside.

    Args:
        points: [m], shape (n, 3).
        vertices: Of the surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    near = points[((points >= low) & (points <= high)).all(axis=1)]
    if not len(near):
        return 0.0
    report = MeshReport(open_edges=1, solid=False)
    skin = ObjectSet(GraspObject("skin", np.asarray(vertices, dtype=np.float64), faces, report))
    return max(0.0, -float(skin.distances(near, threads=1).distance.min()))
