"""Writer of Wavefront OBJ: a file per frame, and the rest mesh that accompanies point caches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.files.sequences import remove_former
from warpjld.geometry.surface import Surface
from warpjld.io.caches.cache import Cache

__all__ = ["ObjCache", "ObjText"]


class ObjText:
    """A surface as OBJ text in source order; everything but the positions is formatted once."""

    def __init__(self, surface: Surface, name: str) -> None:
        count = len(surface.weld)
        # nine digits represent a float32 exactly
        self._positions = "v %.9g %.9g %.9g\n" * count
        corners = surface.source_faces + 1
        uv, index = surface.uv, corners
        if surface.corner_uv is not None:
            uv, kind = np.unique(surface.corner_uv.reshape(-1, 2), axis=0, return_inverse=True)
            index = kind.reshape(corners.shape).astype(np.int32) + 1
        if uv is None:
            texture = ""
            faces = "f %d %d %d\n" * len(corners) % tuple(corners.ravel().tolist())
        else:
            texture = "vt %.9g %.9g\n" * len(uv) % tuple(np.asarray(uv, float).ravel().tolist())
            both = np.stack([corners, index], axis=-1).ravel()
            faces = "f %d/%d %d/%d %d/%d\n" * len(corners) % tuple(both.tolist())
        self._head = f"# metres, Y up\no {name}\n"
        self._tail = f"{texture}s 1\n{faces}"

    def format(self, vertices: NDArray[np.float32]) -> bytes:
        """The file content for positions (W, 3)."""
        return (self._head + self._positions % tuple(vertices.ravel().tolist()) + self._tail).encode()


class ObjCache(Cache):
    """OBJ sequence: ``hand.0000.obj``, ``hand.0001.obj``, … for ``hand.obj``, numbered from the clip's first frame."""

    note = "one file a frame, in the source's vertex order"

    def _begin(self) -> None:
        self._text = ObjText(self.surface, self.clip.name)

    def _append(self, vertices: NDArray[np.float32]) -> None:
        self._part(self._numbered()).write_bytes(self._text.format(vertices))

    def _finish(self) -> None:
        self._close()

    def _close(self) -> None:
        pass  # each frame's file is closed at once

    def _published(self) -> None:
        remove_former(self._parts)

    def _numbered(self) -> Path:
        return self.path.with_name(f"{self.path.stem}.{self.clip.start + self.written:04d}{self.path.suffix}")
