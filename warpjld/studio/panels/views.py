"""Views of the stage: the presets of ``CAMERA``, and the ``CAMERA`` line of what is seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.errors import InputError
from warpjld.render.camera import VIEWS, Camera
from warpjld.studio.key_lines import number

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["ViewsPanel", "camera_line"]

_AS_IT_IS = "as it is"
_DIGITS = 4  # decimals of positions [m]: a tenth of a millimetre


class ViewsPanel:
    """List of the presets, which move the camera of the window, and a button that writes the ``CAMERA`` line."""

    def __init__(self, room: Room) -> None:
        self._room = room
        gui = room.server.gui
        self.view = gui.add_dropdown("View", (_AS_IT_IS, *VIEWS), initial_value=_AS_IT_IS)
        self.take = gui.add_button(
            "CAMERA: this view", hint="pictures and films after this line show what this window shows now"
        )
        self.view.on_update(lambda event: room.by_hand(event, lambda: self._look(event.client)))
        self.take.on_click(lambda event: room.post(lambda: self._write(event.client)))

    def refresh(self) -> None:
        """A preset that was looked from is not a state of the view, which is turned afterwards."""
        if self.view.value != _AS_IT_IS:
            self.view.value = _AS_IT_IS

    def _look(self, client: Any) -> None:
        state, name = self._room.state, self.view.value
        if name == _AS_IT_IS:
            return
        if not state.scene.actors:
            raise InputError(f"the view '{name}' is one of an actor, and there is none")
        window = client.camera
        height = 720
        size = (max(1, round(height * float(window.aspect))), height)
        camera = state.surfaces.camera(state.scene, state.frame, name, size)
        with client.atomic():
            window.up_direction = np.array(camera.up)
            window.fov = camera.angle
            window.position, window.look_at = np.array(camera.position), np.array(camera.target)

    def _write(self, client: Any) -> None:
        if client is not None:
            window = client.camera
            self._room.state.do(camera_line(window.position, window.look_at, float(window.fov)))


def camera_line(position: Any, target: Any, angle: float) -> str:
    """``CAMERA`` line of a view from a position at a target [m], with a vertical field of view [rad].

    Pictures have one field of view; another is made up for by ``ZOOM``.
    """
    eye, centre = (" ".join(number(float(value), _DIGITS) for value in place) for place in (position, target))
    zoom = number(float(np.tan(Camera.angle / 2.0) / np.tan(angle / 2.0)), 3)
    return f"CAMERA FROM {eye} TO {centre}" + ("" if zoom == "1" else f" ZOOM {zoom}")
