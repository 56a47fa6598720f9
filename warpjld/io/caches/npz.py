"""Writer of NumPy archives (``numpy.load``): frames are streamed into the archive, never held in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.files.array_archive import ArrayArchive
from warpjld.io.caches.cache import Cache

__all__ = ["NpzCache"]


class NpzCache(Cache):
    """NumPy archive with arrays in the source's vertex order (W vertices, S triangles):

    - ``vertices`` float32 (frames, W, 3) [m]; ``rest`` float32 (W, 3) [m]
    - ``faces`` int32 (S, 3)
    - ``uv`` float32 (W, 2): texture coordinates, if the source has any; ``corner_uv`` float32 (S, 3, 2) instead,
      per face corner, if a vertex has several
    - ``frames`` int64 (frames,): frame numbers; ``rate`` float64 (): frames per second
    - ``weld`` int32 (W,): vertices with the same value are one point of the surface, split at a texture seam
    """

    note = "vertices, faces, uv and rest are in the source's vertex order"

    _archive: ArrayArchive | None = None

    def _begin(self) -> None:
        surface, clip = self.surface, self.clip
        self._archive = ArrayArchive(self._part(self.path))
        self._archive.add("rest", self.rest)
        self._archive.add("faces", surface.source_faces)
        self._archive.add("weld", surface.weld)
        self._archive.add("rate", np.float64(clip.rate))
        self._archive.add("frames", clip.start + np.arange(clip.frames))
        if surface.uv is not None:
            self._archive.add("uv", np.asarray(surface.uv, np.float32))
        if surface.corner_uv is not None:
            self._archive.add("corner_uv", np.asarray(surface.corner_uv, np.float32))
        self._archive.begin("vertices", (clip.frames, len(surface.weld), 3), "<f4")

    def _append(self, vertices: NDArray[np.float32]) -> None:
        assert self._archive is not None
        self._archive.extend(vertices)

    def _finish(self) -> None:
        assert self._archive is not None
        self._archive.close()

    def _close(self) -> None:
        if self._archive is not None:
            self._archive.discard()
