"""3D view of the actors and objects at the current frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.page.first_view import look
from warpjld.page.server import add_colored, add_surface, rgb
from warpjld.render.style import Style
from warpjld.studio.surfaces import COLORINGS, Shown

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["StagePanel"]

_CONTACT, _POINT = "#12b886", 8e-4
"""Colour and size [m] of contact points."""


class StagePanel:
    """Draws the scene, shaded or as wireframe, with or without skeletons; and its controls."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._meshes: dict[str, Any] = {}
        self._bones: dict[str, Any] = {}
        self._drawn: dict[str, Shown] = {}
        self._looked_at = False
        gui = room.server.gui
        self.coloring = gui.add_dropdown("Colours", COLORINGS, initial_value="skin")
        self.coloring.on_update(lambda event: room.by_hand(event, self._color, key="coloring"))
        self.style = gui.add_dropdown("Skin", ("shaded", "wire-frame", "x-ray"), initial_value="shaded")
        self.skeleton = gui.add_checkbox("Skeleton", False)
        self.objects = gui.add_checkbox("Objects", True)
        self.contacts = gui.add_checkbox("Contact points", False)
        self._contacts: Any = None
        for control in (self.style, self.skeleton, self.objects, self.contacts):
            control.on_update(lambda event: room.by_hand(event, lambda: None, key="style"))

    @property
    def drawn(self) -> list[Shown]:
        """Surfaces that are currently drawn."""
        return [*self._drawn.values()]

    def refresh(self) -> None:
        """Draw what changed."""
        if self.coloring.value != self._room.state.coloring:
            self.coloring.value = self._room.state.coloring
        things = self._room.state.scene.props
        every = self._room.state.shown()
        shown = {one.name: one for one in every if self.objects.value or one.name not in things}
        with self._room.server.atomic():
            for name in [*self._meshes]:
                if name not in shown or _other_kind(shown[name], self._drawn[name]):
                    self._remove(name)
            for name, one in shown.items():
                self._draw(name, one)
                self._draw_skeleton(name, one)
            self._draw_contacts()
        self._drawn = shown
        if shown and not self._looked_at:
            look(self._room.server, np.concatenate([one.vertices for one in shown.values()]))
        self._looked_at = bool(shown)

    def _draw(self, name: str, one: Shown) -> None:
        if one.colors is not None:
            self._draw_colored(name, one)
            return
        style = self.style.value
        opacity = 0.35 if style == "x-ray" else None
        if name not in self._meshes:
            self._meshes[name] = add_surface(
                self._room.server,
                f"/stage/{name}",
                one.vertices,
                one.faces,
                one.color or Style().skin,
                wireframe=style == "wire-frame",
                opacity=opacity,
            )
            return
        mesh = self._meshes[name]
        if not np.array_equal(one.vertices, self._drawn[name].vertices):
            mesh.vertices = one.vertices
        if (mesh.wireframe, mesh.opacity) != (style == "wire-frame", opacity):
            self._remove(name)
            self._draw(name, one)

    def _draw_colored(self, name: str, one: Shown) -> None:
        old = self._drawn.get(name)
        if name in self._meshes and old is not None and _same_colored(one, old):
            return
        assert one.colors is not None
        self._meshes[name] = add_colored(self._room.server, f"/stage/{name}", one.vertices, one.faces, one.colors)

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
                f"/bones/{name}", points, np.array(rgb(Style().bone), np.uint8), thickness=0.008 * size
            )
        elif not np.array_equal(points, self._bones[name].points):
            self._bones[name].points = points

    def _draw_contacts(self) -> None:
        points = self._room.state.contacts() if self.contacts.value else np.zeros((0, 3), np.float32)
        if self._contacts is not None and not np.array_equal(self._contacts.points, points):
            self._contacts.remove()
            self._contacts = None
        if self._contacts is None and len(points):
            color = np.array(rgb(_CONTACT), np.uint8)
            self._contacts = self._room.server.scene.add_point_cloud(
                "/contacts", points, color, point_size=_POINT, point_shape="circle"
            )

    def _remove(self, name: str) -> None:
        self._meshes.pop(name).remove()
        if name in self._bones:
            self._bones.pop(name).remove()


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
