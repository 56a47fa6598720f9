"""Writer of NumPy archives (``numpy.load``): frames are streamed into the archive, never held in memory."""

from __future__ import annotations

import contextlib
import zipfile
from typing import IO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import ArrayLike, NDArray

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

    _archive: zipfile.ZipFile | None = None
    _member: IO[bytes] | None = None

    def _begin(self) -> None:
        self._archive = zipfile.ZipFile(self._part(self.path), "w", zipfile.ZIP_STORED, allowZip64=True)
        constants: dict[str, ArrayLike] = {
            "rest": self.rest,
            "faces": self.surface.source_faces,
            "weld": self.surface.weld,
            "rate": np.float64(self.clip.rate),
            "frames": self.clip.start + np.arange(self.clip.frames),
        }
        if self.surface.uv is not None:
            constants["uv"] = np.asarray(self.surface.uv, np.float32)
        if self.surface.corner_uv is not None:
            constants["corner_uv"] = np.asarray(self.surface.corner_uv, np.float32)
        for name, array in constants.items():
            with self._archive.open(f"{name}.npy", "w") as member:
                npy.write_array(member, np.asarray(array), allow_pickle=False)
        self._member = self._archive.open("vertices.npy", "w", force_zip64=True)
        shape = (self.clip.frames, len(self.surface.weld), 3)
        npy.write_array_header_1_0(self._member, {"descr": "<f4", "fortran_order": False, "shape": shape})

    def _append(self, vertices: NDArray[np.float32]) -> None:
        assert self._member is not None
        self._member.write(vertices.data)

    def _finish(self) -> None:
        self._close()

    def _close(self) -> None:
        member, archive, self._member, self._archive = self._member, self._archive, None, None
        try:
            if member is not None:
                member.close()
            if archive is not None:
                archive.close()
        except OSError:  # full disk: prevent another attempt to close, and another error, when it is deleted
            if archive is not None:
                file, archive.fp = archive.fp, None
                if file is not None:
                    with contextlib.suppress(OSError):
                        file.close()
            raise
