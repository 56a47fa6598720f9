"""Surfaces of a scene at a frame for the 3D view, by actor and object, optionally with vertex colours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.render.colors import ColorScale
from warpjld.script.crowd import Crowd, Role
from warpjld.script.outputs import CameraSetting
from warpjld.script.pressure import PressureView
from warpjld.script.runner import cast
from warpjld.script.scene import Actor, Scene

if TYPE_CHECKING:
    from warpjld.render import Camera
    from warpjld.simulation.display.surfaces import DeformedSurfaces

__all__ = ["COLORINGS", "Coloring", "Shown", "Surfaces"]

Coloring = Literal["skin", "pressure", "domains", "stretch"]
COLORINGS: tuple[Coloring, ...] = ("skin", "pressure", "domains", "stretch")
"""Quantities that skin can be coloured by."""

_TOUCHED = 100.0  # pressure from which a point counts as in contact [Pa]
_STRETCH = ColorScale(0.6, 1.4, "length over rest", ("#2c5aa0", "#e9e4dc", "#b3261e"))


@dataclass(frozen=True, eq=False)
class Shown:
    """One surface: of an actor, of an object, or of all bodies that are coloured by pressure.

    Attributes:
        name: Name in upper case.
        vertices: Positions [m], float32, shape (V, 3).
        faces: Triangles, shape (T, 3).
        color: ``#rrggbb``; None: the default colour of skin.
        colors: Vertex colours, uint8, shape (V, 3); None for a uniform colour.
        joints: For an actor, positions of its joints [m], shape (J, 3).
        bones: Pairs of joints, shape (B, 2).
    """

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    color: str | None = None
    colors: NDArray[np.uint8] | None = None
    joints: NDArray[np.float64] | None = None
    bones: NDArray[np.int32] | None = None


class Surfaces:
    """Deforms the actors of scenes; coverings are reused from one scene to the next."""

    def __init__(self, device: str = "cpu") -> None:
        self._device = device
        self._bound: dict[str, Actor] = {}

    def at(
        self, scene: Scene, frame: float, coloring: Coloring = "skin", pressed: DeformedSurfaces | None = None
    ) -> list[Shown]:
        """All surfaces of a scene at a frame; those of the contact solution where there is one."""
        if not scene.actors:
            return []
        crowd = replace(self._crowd(scene, frame), pressed=pressed)
        if coloring == "pressure" and pressed is not None:
            return self._by_pressure(crowd)
        shown = [self._role(crowd, role, coloring) for role in crowd.roles]
        for prop, vertices in zip(crowd.props, crowd.solid_vertices(0), strict=True):
            shown.append(Shown(prop.name, vertices.astype(np.float32), prop.thing.faces, prop.color))
        return shown

    def camera(self, scene: Scene, frame: float, view: str, size: tuple[int, int]) -> Camera:
        """Camera of a named view of a scene with actors at a frame, for pictures with this width and height."""
        return self._crowd(scene, frame).camera(CameraSetting(view), size)

    def contacts(self, scene: Scene, frame: float, pressed: DeformedSurfaces) -> NDArray[np.float32]:
        """Points in contact, on skin and on deformable objects [m], shape (n, 3)."""
        crowd = replace(self._crowd(scene, frame), pressed=pressed)
        points, values = self._pressures(PressureView(crowd, None), crowd)
        return points[values > _TOUCHED].astype(np.float32)

    def _pressures(self, view: PressureView, crowd: Crowd) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return view.at(0, np.concatenate([self._worn(crowd, role) for role in crowd.roles]))

    def _crowd(self, scene: Scene, frame: float) -> Crowd:
        for actor in scene.actors.values():
            self._rebind(actor)
        crowd = cast(scene, np.array([float(frame)]), device=self._device)
        self._bound = {role.actor.name: role.actor for role in crowd.roles}
        return crowd

    def _rebind(self, actor: Actor) -> None:
        """Reuse the covering that the same rig had in the previous scene."""
        old = self._bound.get(actor.name)
        if actor.covering is None and old is not None and old.covering is not None:
            same = old.rig is actor.rig and old.skeleton is actor.skeleton
            if same and old.covered == (actor.method, actor.domains):
                actor.covering, actor.covered = old.covering, old.covered

    def _worn(self, crowd: Crowd, role: Role) -> NDArray[np.float32]:
        return crowd.worn(role, role.covering.deform(role.poses, device=self._device), 0)[0].astype(np.float32)

    def _role(self, crowd: Crowd, role: Role, coloring: Coloring) -> Shown:
        vertices, covering = self._worn(crowd, role), role.covering
        bones = np.array([(s.proximal, s.distal) for s in covering.skeleton.segments], dtype=np.int32).reshape(-1, 2)
        colors = None
        if coloring == "domains":
            colors = _domain_colors(covering.domains)
        elif coloring == "stretch":
            colors = _STRETCH.colors(_stretch(covering.surface.vertices, vertices, covering.surface.faces))
        joints = role.poses.positions[0]
        return Shown(role.actor.name, vertices, covering.surface.faces, None, colors, joints, bones)

    def _by_pressure(self, crowd: Crowd) -> list[Shown]:
        view = PressureView(crowd, None)
        points, values = self._pressures(view, crowd)
        shown = [Shown("PRESSURE", points.astype(np.float32), view.faces, None, view.scale.colors(values))]
        for prop, vertices in zip(view.plain, view.others(0), strict=True):
            shown.append(Shown(prop.name, vertices.astype(np.float32), prop.thing.faces, prop.color))
        return shown


def _domain_colors(domains: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Vertex colours by operator, blended where domains overlap, shape (V, 3)."""
    import matplotlib

    hues = (np.arange(domains.shape[1]) * 7) % 20
    colors = matplotlib.colormaps["tab20"](hues / 19.5)[:, :3]
    return np.rint(255 * np.clip(domains @ colors, 0, 1)).astype(np.uint8)


def _stretch(rest: NDArray[np.floating], now: NDArray[np.floating], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Mean ratio of edge length to rest length at every vertex, shape (V,)."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    before, after = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (rest, now))
    ratio = after / np.maximum(before, 1e-12)
    count = np.bincount(edges.ravel(), minlength=len(rest))
    total = np.bincount(edges.ravel(), np.repeat(ratio, 2), minlength=len(rest))
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), 1.0))
