"""Writer of MDD, LightWave's point cache, read by Blender's Mesh Cache modifier and by Maya's importers.

Big-endian: ``int32 frames``, ``int32 points``, ``float32 time [s]`` of every frame, then float32 x, y, z of every
point of every frame.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from warpjld.io.caches.points import PointCache

__all__ = ["MddCache"]


class MddCache(PointCache):
    """MDD with the frames' times in seconds."""

    def _header(self) -> bytes:
        times = (self.clip.start + np.arange(self.clip.frames)) / self.clip.rate
        return struct.pack(">ii", self.clip.frames, len(self.surface.weld)) + times.astype(">f4").tobytes()

    def _append(self, vertices: NDArray[np.float32]) -> None:
        super()._append(vertices.astype(">f4"))
