"""A ``FILM`` as an HTML page: an interactive 3D animation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.page.recording import PageRecording
from warpjld.render.style import Style
from warpjld.script.crowd import Crowd
from warpjld.script.outputs import FilmOutput
from warpjld.script.pressure import PressureView
from warpjld.script.scene import Scene

__all__ = ["PageStudio", "page_studio"]


class PageStudio:
    """Records the frames of a page."""

    def __init__(self, crowd: Crowd, film: FilmOutput, page: PageRecording) -> None:
        self._crowd, self._film, self._page = crowd, film, page
        self._view = PressureView(crowd, film.only, film.digits) if film.style == "pressure" else None

    def take(self, frame: int, vertices: NDArray[np.float32]) -> None:
        """Record the ``frame``-th of the frames, with the concatenated vertices of all actors [m], shape (V, 3)."""
        shift = self._crowd.shift(self._film.camera, frame)
        props, moved = self._crowd.props, self._crowd.solid_vertices(frame, shift)
        if self._view is None:
            wires = self._film.style == "wireframe"
            self._page.surface("skin", vertices - shift, self._crowd.faces, Style().skin, wireframe=wires)
        else:
            points, values = self._view.at(frame, vertices)
            self._page.colored("pressure", points - shift, self._view.faces, self._view.scale.colors(values))
            props, moved = self._view.plain, [v - shift for v in self._view.others(frame)]
        for prop, places in zip(props, moved, strict=True):
            self._page.surface(f"objects/{prop.name}", places, prop.thing.faces, prop.color)
        self._page.step()


@contextmanager
def page_studio(scene: Scene, crowd: Crowd, film: FilmOutput, path: Path) -> Iterator[PageStudio]:
    """Context that records a page."""
    with PageRecording(path, rate=scene.rate) as page:
        yield PageStudio(crowd, film, page)
