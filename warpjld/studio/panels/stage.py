"""The stage: actors and objects as they are at the frame that is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from warpjld.render.style import Style
from warpjld.studio.surfaces import COLORINGS, Shown

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["StagePanel"]

_FIELD = 0.6  # vertical opening of the camera [rad]


class StagePanel:
    """Draws what is on stage, and how: shaded or as wires, with or without the skeleton."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._meshes: dict[str, Any] = {}
        self._bones: dict[str, Any] = {}
        self._drawn: dict[str, Shown] = {}
        self._looked_at = False
        server = room.server
        server.scene.set_up_direction("+y")
        server.scene.world_axes.visible = False
        _light(server)
        server.initial_camera.fov = _FIELD
        server.initial_camera.near = 0.005
        gui = server.gui
        self.coloring = gui.add_dropdown("Colours", COLORINGS, initial_value="skin")
        self.coloring.on_update(lambda event: room.by_hand(event, self._color, key="coloring"))
        self.style = gui.add_dropdown("Skin", ("shaded", "wire-frame", "x-ray"), initial_value="shaded")
        self.skeleton = gui.add_checkbox("Skeleton", False)
        for control in (self.style, self.skeleton):
            control.on_update(lambda event: room.by_hand(event, lambda: None, key="style"))

    def refresh(self) -> None:
        """Draw what changed."""
        if self.coloring.value != self._room.state.coloring:
            self.coloring.value = self._room.state.coloring
        shown = {one.name: one for one in self._room.state.shown()}
        with self._room.server.atomic():
            for name in [*self._meshes]:
                if name not in shown or _other_kind(shown[name], self._drawn[name]):
                    self._remove(name)
            for name, one in shown.items():
                self._draw(name, one)
                self._draw_skeleton(name, one)
        self._drawn = shown
        if shown and not self._looked_at:
            self._look(np.concatenate([one.vertices for one in shown.values()]))
        self._looked_at = bool(shown)

    def _draw(self, name: str, one: Shown) -> None:
        if one.colors is not None:
            self._draw_colored(name, one)
            return
        style = self.style.value
        opacity = 0.35 if style == "x-ray" else None
        if name not in self._meshes:
            self._meshes[name] = self._room.server.scene.add_mesh_simple(
                f"/stage/{name}",
                one.vertices,
                one.faces.astype(np.uint32),
                color=_rgb(one.color or Style().skin),
                wireframe=style == "wire-frame",
                opacity=opacity,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            return
        mesh = self._meshes[name]
        if not np.array_equal(one.vertices, self._drawn[name].vertices):
            mesh.vertices = one.vertices
        mesh.wireframe = style == "wire-frame"
        mesh.opacity = opacity

    def _draw_colored(self, name: str, one: Shown) -> None:
        old = self._drawn.get(name)
        if name in self._meshes and old is not None and _same_colored(one, old):
            return
        mesh = trimesh.Trimesh(one.vertices, one.faces, vertex_colors=one.colors, process=False)
        self._meshes[name] = self._room.server.scene.add_mesh_trimesh(
            f"/stage/{name}", mesh, cast_shadow=False, receive_shadow=False
        )

    def _color(self) -> None:
        self._room.state.coloring = self.coloring.value

    def _draw_skeleton(self, name: str, one: Shown) -> None:
        if one.joints is None or one.bones is None:
            return
        wanted = self.skeleton.value
        if not wanted:
            if name in self._bones:
                self._bones.pop(name).remove()
            return
        points = one.joints[one.bones].astype(np.float32)
        if name not in self._bones:
            size = float(np.ptp(one.vertices, axis=0).max())
            self._bones[name] = self._room.server.scene.add_line_segments(
                f"/bones/{name}", points, np.array(_rgb(Style().bone), np.uint8), thickness=0.008 * size
            )
        elif not np.array_equal(points, self._bones[name].points):
            self._bones[name].points = points

    def _remove(self, name: str) -> None:
        self._meshes.pop(name).remove()
        if name in self._bones:
            self._bones.pop(name).remove()

    def _look(self, points: NDArray[np.float32]) -> None:
        """Set every window's camera so that these points fill it."""
        low, high = points.min(axis=0), points.max(axis=0)
        centre = (low + high) / 2.0
        away = float(np.linalg.norm(high - low)) / 2.0 / np.tan(_FIELD / 2.0) * 1.1
        eye = centre + away * np.array([0.45, 0.75, 0.5]) / np.linalg.norm([0.45, 0.75, 0.5])
        first = self._room.server.initial_camera
        first.position, first.look_at = tuple(eye), tuple(centre)
        for client in self._room.server.get_clients().values():
            with client.atomic():
                client.camera.position, client.camera.look_at = eye, centre


def _same_colored(one: Shown, old: Shown) -> bool:
    """Whether a coloured surface is drawn as it is."""
    if one.colors is None or old.colors is None:
        return False
    return np.array_equal(old.colors, one.colors) and np.array_equal(old.vertices, one.vertices)


def _other_kind(one: Shown, old: Shown) -> bool:
    """Whether a surface must be sent anew, not only its vertices."""
    if (one.colors is None) != (old.colors is None):
        return True
    return one.colors is None and not np.array_equal(one.faces, old.faces)


def _light(server: Any) -> None:
    """Light from all sides and one lamp over the shoulder, without shadows: what bends is seen, and drawn fast."""
    server.scene.configure_environment_map(None)
    server.scene.configure_default_lights(False)
    server.scene.add_light_hemisphere(
        "/light/sky", sky_color=(255, 252, 246), ground_color=(150, 140, 150), intensity=1.3
    )
    server.scene.add_light_directional("/light/lamp", intensity=2.4, position=(1.0, 2.0, 1.0))
    server.scene.add_light_directional("/light/rim", intensity=0.5, position=(-1.5, 0.5, -1.0))


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
