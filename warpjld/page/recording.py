"""Recording of an animation as one self-contained, interactive HTML file."""

from __future__ import annotations

import secrets
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.whole_file import whole_file
from warpjld.page.first_view import look
from warpjld.page.guard import RequestGuard
from warpjld.page.server import add_colored, add_surface, guarded_server, stop

__all__ = ["PageRecording"]

_GRAIN = 2.0**-17
"""Resolution of positions [m], 8 µm; invisible, and it halves the size of the compressed file."""


class PageRecording:
    """Context manager that records surfaces frame by frame; the file is written atomically at the end.

    Args:
        path: The file.
        rate: Frames per second.

    Raises:
        InputError: On leaving: no frame was taken, or the file cannot be written.
        MissingExtraError: On entering: viser is not installed.
    """

    def __init__(self, path: str | Path, *, rate: float = 25.0) -> None:
        self.path, self.rate = Path(path), float(rate)
        self._drawn: dict[str, tuple[NDArray[np.float32], NDArray[np.uint8] | None]] = {}
        self._meshes: dict[str, Any] = {}
        self._recorder: Any = None

    def __enter__(self) -> Self:
        # viser's recorder is part of its server: start one that refuses all requests
        nobody = RequestGuard("127.0.0.1", secrets.token_urlsafe(24))
        self._server = guarded_server(nobody, 0, f"the page '{self.path.name}'")
        return self

    def surface(
        self,
        name: str,
        vertices: NDArray[np.floating],
        faces: NDArray[np.int32],
        color: str,
        *,
        wireframe: bool = False,
    ) -> None:
        """Add a surface of one colour to this frame: vertices (V, 3) [m]; triangles (T, 3), the same in every frame."""
        places = _grained(vertices)
        if name not in self._meshes:
            self._meshes[name] = add_surface(self._server, f"/{name}", places, faces, color, wireframe=wireframe)
        elif not np.array_equal(self._drawn[name][0], places):
            self._meshes[name].vertices = places
        self._drawn[name] = places, None

    def colored(
        self, name: str, vertices: NDArray[np.floating], faces: NDArray[np.int32], colors: NDArray[np.uint8]
    ) -> None:
        """Add a surface with vertex colours (V, 3) to this frame."""
        places, old = _grained(vertices), self._drawn.get(name)
        if old is None or old[1] is None or not (np.array_equal(old[0], places) and np.array_equal(old[1], colors)):
            add_colored(self._server, f"/{name}", places, faces, colors)
        self._drawn[name] = places, colors

    def step(self) -> None:
        """Finish the frame."""
        if self._recorder is None:
            look(self._server, np.concatenate([places for places, _ in self._drawn.values()]))
            self._recorder = self._server.get_scene_serializer()
        self._recorder.insert_sleep(1.0 / self.rate)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                if self._recorder is None:
                    raise InputError("a page needs at least one frame", path=self.path)
                page = self._recorder.as_html()
                with whole_file(self.path) as part:
                    part.write_text(page, encoding="utf-8")
        except OSError as failure:
            raise InputError(f"cannot write: {failure.strerror or failure}", path=self.path) from failure
        finally:
            stop(self._server)


def _grained(vertices: NDArray[np.floating]) -> NDArray[np.float32]:
    return (np.rint(np.asarray(vertices, np.float64) / _GRAIN) * _GRAIN).astype(np.float32)
