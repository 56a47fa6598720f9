"""Writer of Alembic: a polygon mesh under a transform, a sample of positions per frame.

Alembic stores neither units nor an up axis; programs assume Y up. Its faces are clockwise seen from outside, so face
corners and their texture coordinates are reversed. Frame n is at n / rate seconds.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import MissingExtraError
from warpjld.io.caches.cache import Cache

__all__ = ["AlembicCache"]

_ROOM = 16 << 20  # bytes of disk space to leave free: other programs write, too, and the archive's index comes last


def _alembic() -> tuple[Any, Any, Any]:
    """The modules ``Abc`` and ``AbcGeom``, and the class ``TimeSampling``."""
    try:
        from alembic3d import Abc, AbcGeom
        from alembic3d.AbcCoreAbstract import TimeSampling
    except ImportError as error:
        raise MissingExtraError("Alembic", "abc") from error
    return Abc, AbcGeom, TimeSampling


class AlembicCache(Cache):
    """Alembic in its Ogawa format, written sample by sample."""

    note = "Y up, metres, points in the source's vertex order, faces wound clockwise as Alembic has them"

    _archive: Any = None
    _mesh: Any = None

    @classmethod
    def check(cls) -> None:
        """Check that Alembic is installed.

        Raises:
            MissingExtraError: It is not installed.
        """
        _alembic()

    def _begin(self) -> None:
        Abc, AbcGeom, TimeSampling = _alembic()
        name = self.clip.name.replace("/", "_") or "surface"
        with _refusals():
            self._archive = Abc.OArchive(str(self._part(self.path)))
            rate = self.clip.rate
            sampling = self._archive.addTimeSampling(TimeSampling(1.0 / rate, self.clip.start / rate))
            transform = AbcGeom.OXform(self._archive.getTop(), name)
            self._mesh = AbcGeom.OPolyMesh(transform, f"{name}Shape", sampling)

    def _append(self, vertices: NDArray[np.float32]) -> None:
        import imath
        from alembic3d import AbcGeom

        self._check_room(vertices.nbytes)
        sample = AbcGeom.OPolyMeshSchemaSample()
        kept = [_array(imath.V3fArray, vertices)]  # samples keep no references to their arrays
        sample.setPositions(kept[0])
        if self.written == 0:
            faces = self.surface.source_faces[:, ::-1]
            kept += [_array(imath.IntArray, faces.ravel()), _array(imath.IntArray, np.full(len(faces), 3))]
            sample.setFaceIndices(kept[1])
            sample.setFaceCounts(kept[2])
            uv = self.surface.corner_uv
            if uv is None and self.surface.uv is not None:
                uv = self.surface.uv[self.surface.source_faces]
            if uv is not None:
                kept.append(_array(imath.V2fArray, uv[:, ::-1].reshape(-1, 2)))
                sample.setUVs(AbcGeom.OV2fGeomParamSample(kept[3], AbcGeom.GeometryScope.kFacevaryingScope))
        with _refusals():
            self._mesh.getSchema().set(sample)

    def _check_room(self, size: int) -> None:
        """Check the free disk space: Alembic's library terminates the process when the disk is full."""
        if shutil.disk_usage(self.path.parent).free < _ROOM + 4 * size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _finish(self) -> None:
        self._check_room(0)
        self._close()

    def _close(self) -> None:
        # the file is completed when the archive object is deleted
        self._mesh = None
        self._archive = None


def _array(kind: Any, values: NDArray[Any]) -> Any:
    array = kind(len(values))
    np.asarray(memoryview(array))[...] = values
    return array


@contextlib.contextmanager
def _refusals() -> Iterator[None]:
    try:
        yield
    except RuntimeError as error:
        raise OSError(str(error).strip().splitlines()[-1]) from error
