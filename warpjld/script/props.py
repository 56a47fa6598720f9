"""Objects on the stage: where they are at any frame, and how they are drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.attach import Association, carried, joint_basis
from warpjld.grasp.objects import GraspObject, Places
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.script.scene import Scene
    from warpjld.surface import Surface

__all__ = ["COLORS", "Prop", "prop_places", "prop_surface"]

COLORS = ("#7fa3b8", "#c98b5a", "#8fae7c", "#b58bb0", "#c9b458", "#8a8f98")
"""Colours of the objects that are given none, in turn."""


@dataclass(eq=False)
class Prop:
    """An object on the stage.

    Attributes:
        name: Upper case.
        thing: The object at its initial place.
        color: Name or ``#rrggbb``.
        associations: Joints it follows.
    """

    name: str
    thing: GraspObject
    color: str
    associations: list[Association] = field(default_factory=list)


def prop_places(scene: Scene, prop: Prop, frames: NDArray[np.float64]) -> Places:
    """Where an object is at F frames (R70–R72)."""

    def basis(association: Association, at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        actor = scene.actor(association.actor)
        return joint_basis(actor.skeleton, stage(actor, at, scene.rate), association.joint)

    return carried(prop.thing.place, prop.associations, frames, basis)


def prop_surface(prop: Prop) -> Surface:
    """The object's surface for exports."""
    from warpjld.surface import weld_surface

    return weld_surface(prop.thing.vertices, prop.thing.faces, tolerance=0.0)
