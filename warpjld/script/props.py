"""Objects of a scene: shape and placement at any frame, colour, surface for exports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.attach import Association, carried, joint_basis
from warpjld.grasp.objects import GraspObject, Places
from warpjld.script.placement import Placement
from warpjld.script.staging import stage
from warpjld.skeleton.streamed_poses import BLOCK

if TYPE_CHECKING:
    from warpjld.fem.contact.obstacles.barr import Barr
    from warpjld.fem.contact.obstacles.obstacle import RigidMotion
    from warpjld.geometry.surface import Surface
    from warpjld.grasp.keyframes import KeyframedShape
    from warpjld.render.texture import MeshTexture
    from warpjld.script.scene import Actor
    from warpjld.simulation.state_variables import BarrKeys

__all__ = ["COLORS", "Prop", "prop_places", "prop_surface", "texture_of"]

COLORS = ("#7fa3b8", "#c98b5a", "#8fae7c", "#b58bb0", "#c9b458", "#8a8f98")
"""Default colours of objects, used in turn."""


@dataclass(eq=False)
class Prop:
    """An object of a scene.

    Attributes:
        name: Its name, in upper case.
        thing: The object at its initial placement.
        color: ``#rrggbb``.
        associations: Joints it is attached to, and when.
        placement: Keys of the object as a whole, applied after the attachments, about its own origin.
        shapes: Key-framed shapes, where it has them.
        barred: Keys of Barr's deformations (taper, twist, bend), where it has them.
        assumed: Unit that was assumed for its file because the script states none.
        colored: Whether the script sets a colour, which replaces the texture of the file.
    """

    name: str
    thing: GraspObject
    color: str
    associations: list[Association] = field(default_factory=list)
    placement: Placement = field(default_factory=Placement)
    shapes: KeyframedShape | None = None
    barred: BarrKeys | None = None
    assumed: str | None = None
    colored: bool = False

    @property
    def deforms(self) -> bool:
        """Whether its shape is a function of time."""
        return self.shapes is not None or self.barred is not None

    def shape(self, frame: float) -> NDArray[np.float64]:
        """Vertices in its own frame at a frame [m], shape (n, 3)."""
        if self.shapes is not None:
            return self.shapes.at(frame)
        if self.barred is not None:
            return self.barr().mesh(frame)[0]
        return self.thing.vertices

    def barr(self, start: float = 0.0, motion: RigidMotion | None = None) -> Barr:
        """Obstacle deformed by Barr's formulas, in the object's frame unless ``motion`` is given; time in frames from
        ``start``."""
        from warpjld.fem.contact.obstacles.barr import Barr

        barred = self.barred
        assert barred is not None
        return Barr(
            (self.thing.vertices, self.thing.faces),
            axis=barred.axis,
            taper=lambda time: barred.at("taper", start + time),
            twist=lambda time: barred.at("twist", start + time),
            bend=lambda time: barred.at("bend", start + time),
            motion=motion,
        )

    @property
    def key_frames(self) -> list[float]:
        """Frames that hold a key of this object."""
        tracks = [*self.placement.tracks.values(), *(self.barred.tracks.values() if self.barred else ())]
        return sorted({frame for track in tracks for frame in track.frames})


def prop_places(actors: Mapping[str, Actor], rate: float, prop: Prop, frames: NDArray[np.float64]) -> Places:
    """Placements of an object at F frames: attachments to joints (R70–R72), then its own keys.

    Args:
        actors: Actors by name.
        rate: Rate of the scene [1/s].
        prop: The object.
        frames: Frame numbers, shape (F,).
    """

    def basis(association: Association, at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        actor = actors[association.actor]
        blocks = [at[k : k + BLOCK] for k in range(0, max(len(at), 1), BLOCK)]
        found = [joint_basis(actor.skeleton, stage(actor, block, rate), association.joint) for block in blocks]
        origins, bases = zip(*found, strict=True)
        return np.concatenate(origins), np.concatenate(bases)

    places = carried(prop.thing.place, prop.associations, frames, basis)
    return prop.placement.apply_to_places(places, frames)


def texture_of(prop: Prop) -> MeshTexture | None:
    """Texture of an object's file; None if the script sets a colour."""
    from PIL import ImageColor

    from warpjld.render.texture import texture_atlas

    red, green, blue = ImageColor.getrgb(prop.color)[:3]
    paint = None if prop.colored else prop.thing.paint
    return texture_atlas([(paint, len(prop.thing.faces), (red, green, blue))], prop.name)


def prop_surface(prop: Prop) -> Surface:
    """The object's surface for exports."""
    from warpjld.geometry.surface import weld_surface

    return weld_surface(prop.thing.vertices, prop.thing.faces, tolerance=0.0)
