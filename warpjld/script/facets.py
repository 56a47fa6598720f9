"""Vertices and facets by their numbers in the files (R133)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor

__all__ = ["Facet", "read_facet", "read_vertex"]


@dataclass(frozen=True, eq=False)
class Facet:
    """A facet of an object: its number in the file, and the rows of its triangles."""

    number: int
    triangles: NDArray[np.int64]

    def coordinates(self, point: NDArray[np.floating], thing: GraspObject) -> tuple[NDArray[np.float64], bool]:
        """A world point in the facet's basis [m], shape (3,), and whether its foot lies in the facet (C19)."""
        from warpjld.grasp import facet_distance

        found = [facet_distance(point[None], thing, int(triangle)) for triangle in self.triangles]
        return found[0].coordinates[0], any(bool(each.inside[0]) for each in found)


def read_vertex(actor: Actor, arguments: Arguments, what: str) -> int:
    """Read a vertex number of the actor's file; the index of the welded vertex."""
    weld = actor.rig.surface.weld
    return int(weld[arguments.integer(what, minimum=0, maximum=len(weld) - 1)])


def read_facet(prop: Prop, arguments: Arguments, what: str) -> Facet:
    """Read a facet number of the object's file; the facet."""
    number = arguments.integer(what, minimum=0)
    try:
        return Facet(number, prop.thing.triangles_of(number))
    except InputError as error:
        raise arguments.error(error.message) from None
