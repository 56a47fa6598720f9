"""Base class of point caches: a header, then every frame's positions; the mesh is written beside them as OBJ."""

from __future__ import annotations

from abc import abstractmethod
from typing import IO

import numpy as np
from numpy.typing import NDArray

from warpjld.io.caches.cache import Cache
from warpjld.io.caches.obj import ObjText

__all__ = ["PointCache"]


class PointCache(Cache):
    """A cache file with positions only; ``hand.rest.obj`` beside it is the mesh to apply it to."""

    note = "holds positions only: apply it to the mesh in the .rest.obj file beside it, whose vertex order it has"

    _file: IO[bytes] | None = None

    @abstractmethod
    def _header(self) -> bytes:
        """Bytes that precede the first frame."""

    def _begin(self) -> None:
        self._file = self._part(self.path).open("wb")
        self._file.write(self._header())
        mesh = ObjText(self.surface, self.clip.name).format(self.rest)
        self._part(self.path.with_name(f"{self.path.stem}.rest.obj")).write_bytes(mesh)

    def _append(self, vertices: NDArray[np.float32]) -> None:
        assert self._file is not None
        self._file.write(vertices.data)

    def _finish(self) -> None:
        self._close()

    def _close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()
