"""Writer of PC2, the point cache of 3ds Max, read by Blender's Mesh Cache modifier and by Maya's importers.

Little-endian: ``char[12] "POINTCACHE2\\0"``, ``int32 version = 1``, ``int32 points``, ``float32 start frame``,
``float32 frames per sample``, ``int32 samples``, then float32 x, y, z of every point of every sample.
"""

from __future__ import annotations

import struct

from warpjld.io.caches.points import PointCache

__all__ = ["Pc2Cache"]


class Pc2Cache(PointCache):
    """Point cache 2, one sample per frame. The format does not store the frame rate."""

    def _header(self) -> bytes:
        points = len(self.surface.weld)
        return struct.pack("<12siiffi", b"POINTCACHE2\0", 1, points, self.clip.start, 1.0, self.clip.frames)
