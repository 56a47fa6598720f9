"""Interactive 3D view of surfaces in a notebook: a local viser page in an iframe, with a frame slider."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.page.first_view import look
from warpjld.page.guard import RequestGuard
from warpjld.page.server import add_colored, add_surface, guarded_server, stop

__all__ = ["SurfaceView", "ViewedSurface"]

_HOST, _HEIGHT = "127.0.0.1", 480
"""Address that the server listens at, and height of the iframe [pixels]."""


@dataclass(frozen=True, eq=False)
class ViewedSurface:
    """One surface at one frame.

    Attributes:
        name: Name, the same at every frame.
        vertices: Positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        color: Colour ``#rrggbb``, used if there are no vertex colours.
        colors: Vertex colours, uint8, shape (V, 3); None if there are none.
    """

    name: str
    vertices: NDArray[np.floating]
    faces: NDArray[np.int32]
    color: str = "#d9a58c"
    colors: NDArray[np.uint8] | None = None


class SurfaceView:
    """View of an animation of surfaces; a notebook shows it if it is the value of a cell. Runs until closed.

    Only pages served from this machine may embed it, and its server refuses connections from other pages.

    Args:
        frames: Surfaces of each frame.
        numbers: Frame numbers; 0, 1, … by default.
        rate: Playback rate [frames/s].

    Attributes:
        address: URL of the page, reachable from this machine only.

    Raises:
        InputError: No frame, or no surface in the first one.
        MissingExtraError: viser is not installed.
    """

    def __init__(
        self, frames: Sequence[Sequence[ViewedSurface]], *, numbers: Sequence[float] | None = None, rate: float = 25.0
    ) -> None:
        if not frames or not frames[0]:
            raise InputError("a view needs at least one frame with a surface")
        self._frames, self._rate = frames, rate
        self._numbers = [float(k) for k in range(len(frames))] if numbers is None else [*map(float, numbers)]
        self._meshes: dict[str, Any] = {}
        self._lock, self._closed = threading.Lock(), threading.Event()
        self._server = guarded_server(RequestGuard(_HOST, framed=True), 0, "a view")
        self.address = f"http://{_HOST}:{self._server.get_port()}/"
        if len(frames) > 1:
            self._add_controls()
        self.draw(0)
        look(self._server, np.concatenate([surface.vertices for surface in frames[0]]))

    def __repr__(self) -> str:
        return f"SurfaceView({len(self._frames)} frames, {self.address})"

    def _repr_html_(self) -> str:
        """HTML that notebooks display: an iframe with the page."""
        return f'<iframe src="{self.address}" width="100%" height="{_HEIGHT}" style="border:0"></iframe>'

    def draw(self, place: int) -> None:
        """Show the frame at this index of ``frames``."""
        with self._lock, self._server.atomic():
            shown = self._frames[place]
            for name in {*self._meshes} - {surface.name for surface in shown}:
                self._meshes.pop(name).remove()
            for surface in shown:
                self._draw(surface)

    def close(self) -> None:
        """Stop playback and the server."""
        self._closed.set()
        stop(self._server)

    def _draw(self, surface: ViewedSurface) -> None:
        vertices, name = np.asarray(surface.vertices, np.float32), f"/{surface.name}"
        if surface.colors is not None:
            self._meshes[surface.name] = add_colored(self._server, name, vertices, surface.faces, surface.colors)
        elif surface.name in self._meshes:
            self._meshes[surface.name].vertices = vertices
        else:
            self._meshes[surface.name] = add_surface(self._server, name, vertices, surface.faces, surface.color)

    def _add_controls(self) -> None:
        gui = self._server.gui
        last = len(self._frames) - 1
        self._place = gui.add_slider("Frame", min=0, max=last, step=1, initial_value=0, hint=self._hint())
        self._play = gui.add_checkbox("Play", False)
        self._place.on_update(lambda _: self.draw(int(self._place.value)))
        threading.Thread(target=self._playback, name="view-play", daemon=True).start()

    def _hint(self) -> str:
        return f"frames {self._numbers[0]:g} to {self._numbers[-1]:g}"

    def _playback(self) -> None:
        while not self._closed.wait(1.0 / self._rate):
            if self._play.value:
                place = (int(self._place.value) + 1) % len(self._frames)
                self._place.value = place
                self.draw(place)
