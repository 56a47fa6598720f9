"""Ghosts (onion skins): actors at the key frames before and after the current frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.normals import vertex_normals
from warpjld.page.server import add_surface

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["GhostsPanel"]

_COLORS = {"before": "#4c78a8", "after": "#e07b39"}
_OPACITY = 0.18  # 0 transparent, 1 opaque
_INSET = 4e-4  # m


class GhostsPanel:
    """Translucent actors at the previous key frame (blue) and the next one (orange)."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._meshes: dict[str, Any] = {}
        self._drawn: dict[str, NDArray[np.float32]] = {}
        self.on = room.server.gui.add_checkbox("Ghosts of neighbouring keys", False)
        self.on.on_update(lambda event: room.by_hand(event, lambda: None, key="ghosts"))

    def refresh(self) -> None:
        """Update the ghosts in the scene."""
        state = self._room.state
        wanted: dict[str, Any] = {}
        for which, key in state.neighbours().items() if self.on.value else ():
            for shown in state.surfaces.at(state.scene, key):
                if shown.name in state.scene.actors:
                    # moved inwards, so that skin that is the same at both frames hides its ghost
                    inset = shown.vertices - np.float32(_INSET) * vertex_normals(shown.vertices, shown.faces)
                    wanted[f"/ghosts/{which}/{shown.name}"] = which, inset, shown.faces
        for name in [*self._meshes]:
            if name not in wanted or len(self._drawn[name]) != len(wanted[name][1]):
                self._meshes.pop(name).remove()
        for name, (which, vertices, faces) in wanted.items():
            if name not in self._meshes:
                self._meshes[name] = add_surface(
                    self._room.server, name, vertices, faces, _COLORS[which], opacity=_OPACITY
                )
            elif not np.array_equal(self._drawn[name], vertices):
                self._meshes[name].vertices = vertices
            self._drawn[name] = vertices
