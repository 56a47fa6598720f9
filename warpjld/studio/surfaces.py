"""What is seen of a scene at a frame: the surfaces that a run makes, by actor and object."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.script.crowd import Crowd
from warpjld.script.runner import cast
from warpjld.script.scene import Actor, Scene

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.simulation.display.surfaces import DeformedSurfaces

__all__ = ["Shown", "Surfaces"]


@dataclass(frozen=True, eq=False)
class Shown:
    """One surface: an actor's or an object's.

    Attributes:
        name: Upper case.
        vertices: Positions [m], float32, shape (V, 3).
        faces: Triangles, shape (T, 3).
        color: ``#rrggbb``, None for skin.
        joints: Of an actor: positions of its joints [m], shape (J, 3).
        bones: Pairs of joints, shape (B, 2).
    """

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    color: str | None = None
    joints: NDArray[np.float64] | None = None
    bones: NDArray[np.int32] | None = None


class Surfaces:
    """Deforms the actors of scenes; what is bound stays bound from one scene to the next."""

    def __init__(self, device: str = "cpu") -> None:
        self._device = device
        self._bound: dict[str, Actor] = {}
        self._scene: Scene | None = None
        self._crowd: Crowd | None = None
        self.pressed: DeformedSurfaces | None = None

    def crowd(self, scene: Scene, frame: float) -> Crowd:
        """The actors of a scene, bound and posed at a frame."""
        if self._crowd is None or self._scene is not scene or len(self._crowd.roles) != len(scene.actors):
            for actor in scene.actors.values():
                self._rebind(actor)
        # what the scene's statements changed of its actors is looked at every time
        self._crowd = cast(scene, np.array([float(frame)]), device=self._device)
        self._scene = scene
        self._bound = {role.actor.name: role.actor for role in self._crowd.roles}
        return replace(self._crowd, pressed=self.pressed)

    def covering(self, actor: Actor) -> Covering:
        """The covering of an actor as it is drawn."""
        from warpjld.script.binding import cover

        self._rebind(actor)
        return cover(actor)

    def at(self, scene: Scene, frame: float) -> list[Shown]:
        """All that is on stage at a frame."""
        if not scene.actors and not scene.props:
            return []
        crowd = self.crowd(scene, frame)
        shown = []
        for role in crowd.roles:
            vertices = crowd.worn(role, role.covering.deform(role.poses, device=self._device), 0)[0]
            bones = np.array([(s.proximal, s.distal) for s in role.covering.skeleton.segments], dtype=np.int32)
            faces = role.covering.surface.faces
            joints = role.poses.positions[0]
            shown.append(Shown(role.actor.name, vertices, faces, None, joints, bones.reshape(-1, 2)))
        for prop, places in zip(crowd.props, crowd.places, strict=True):
            vertices = crowd.prop_vertices(prop, places, 0).astype(np.float32)
            shown.append(Shown(prop.name, vertices, np.asarray(prop.thing.faces, np.int32), prop.color))
        return shown

    def _rebind(self, actor: Actor) -> None:
        """Give an actor the covering that the same rig had in the scene before."""
        old = self._bound.get(actor.name)
        if actor.covering is None and old is not None and old.covering is not None:
            same = old.rig is actor.rig and old.skeleton is actor.skeleton
            if same and old.covered == (actor.method, actor.domains):
                actor.covering, actor.covered = old.covering, old.covered
