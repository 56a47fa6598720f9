"""Surfaces seen in a notebook: a page of this machine in the output of a cell, turned with the mouse, played by a
slider."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.page.guard import RequestGuard
from warpjld.page.server import add_colored, add_surface, guarded_server, look, stop

__all__ = ["SurfaceView", "ViewedSurface"]

_HOST, _HEIGHT = "127.0.0.1", 480
"""Where a view listens, and how high it stands in a notebook [pixels]."""


@dataclass(frozen=True, eq=False)
class ViewedSurface:
    """One surface at a frame.

    Attributes:
        name: The same at every frame.
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        color: ``#rrggbb``, where its vertices have no colours of their own.
        colors: Of the vertices, uint8, shape (V, 3).
    """

    name: str
    vertices: NDArray[np.floating]
    faces: NDArray[np.int32]
    color: str = "#d9a58c"
    colors: NDArray[np.uint8] | None = None


class SurfaceView:
    """Frames of surfaces, each a list of them; shown by the notebook that it is the value of, until it is closed.

    Only pages of this machine may hold it, and nothing but itself may drive it.

    Args:
        frames: What is seen at each.
        numbers: Their numbers; 0, 1, … if left out.
        rate: Frames a second when it plays.

    Attributes:
        address: What to open in a browser of this machine.

    Raises:
        InputError: There is no frame.
        MissingExtraError: viser is not installed.
    """

    def __init__(
        self, frames: Sequence[Sequence[ViewedSurface]], *, numbers: Sequence[float] | None = None, rate: float = 25.0
    ) -> None:
        if not frames or not frames[0]:
            raise InputError("a view wants at least one frame with a surface")
        self._frames, self._rate = frames, rate
        self._numbers = [float(k) for k in range(len(frames))] if numbers is None else [*map(float, numbers)]
        self._meshes: dict[str, Any] = {}
        self._lock, self._closed = threading.Lock(), threading.Event()
        self._server = guarded_server(RequestGuard(_HOST, framed=True), 0, "a view")
        self.address = f"http://{_HOST}:{self._server.get_port()}/"
        if len(frames) > 1:
            self._add_controls()
        self.draw(0)
        look(self._server, np.concatenate([one.vertices for one in frames[0]]))

    def __repr__(self) -> str:
        return f"SurfaceView({len(self._frames)} frames, {self.address})"

    def _repr_html_(self) -> str:
        """What notebooks show."""
        return f'<iframe src="{self.address}" width="100%" height="{_HEIGHT}" style="border:0"></iframe>'

    def draw(self, place: int) -> None:
        """Show the frame of that place."""
        with self._lock, self._server.atomic():
            shown = self._frames[place]
            for name in {*self._meshes} - {one.name for one in shown}:
                self._meshes.pop(name).remove()
            for one in shown:
                self._draw(one)

    def close(self) -> None:
        """End it."""
        self._closed.set()
        stop(self._server)

    def _draw(self, one: ViewedSurface) -> None:
        places, name = np.asarray(one.vertices, np.float32), f"/{one.name}"
        if one.colors is not None:
            self._meshes[one.name] = add_colored(self._server, name, places, one.faces, one.colors)
        elif one.name in self._meshes:
            self._meshes[one.name].vertices = places
        else:
            self._meshes[one.name] = add_surface(self._server, name, places, one.faces, one.color)

    def _add_controls(self) -> None:
        gui = self._server.gui
        last = len(self._frames) - 1
        self._place = gui.add_slider("Frame", min=0, max=last, step=1, initial_value=0, hint=self._hint())
        self._play = gui.add_checkbox("Play", False)
        self._place.on_update(lambda _: self.draw(int(self._place.value)))
        threading.Thread(target=self._run, name="view-play", daemon=True).start()

    def _hint(self) -> str:
        return f"frames {self._numbers[0]:g} to {self._numbers[-1]:g}"

    def _run(self) -> None:
        while not self._closed.wait(1.0 / self._rate):
            if self._play.value:
                place = (int(self._place.value) + 1) % len(self._frames)
                self._place.value = place
                self.draw(place)
