"""Writer of USD caches: a mesh with time-sampled points and extent; a time code is a frame number."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import MissingExtraError
from warpjld.geometry.surface import Surface
from warpjld.io.caches.cache import Cache

__all__ = ["UsdCache", "extent_of", "save_layer", "write_texture_coordinates"]

_FLUSH_BYTES = 32 << 20  # bytes of time samples in memory after which the layer is saved


class UsdCache(Cache):
    """Binary USD. The layer is saved every 32 MB, which frees the samples' memory."""

    note = "Y up, metres, subdivisionScheme none, no normals; faces and points in the source's vertex order"

    _stage: Any = None

    @classmethod
    def check(cls) -> None:
        """Check that OpenUSD is installed.

        Raises:
            MissingExtraError: It is not installed.
        """
        _pxr()

    def _begin(self) -> None:
        self._stage, self._mesh = _build_stage(self, self._part(self.path))
        self._pending = 0

    def _append(self, vertices: NDArray[np.float32]) -> None:
        from pxr import Vt

        time = self.clip.start + self.written
        self._mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(vertices), time)
        self._mesh.GetExtentAttr().Set(extent_of(vertices), time)
        self._pending += vertices.nbytes
        if self._pending > _FLUSH_BYTES:
            self._save()

    def _finish(self) -> None:
        self._save()
        self._close()

    def _save(self) -> None:
        save_layer(self._stage)
        self._pending = 0

    def _close(self) -> None:
        self._stage = self._mesh = None


def save_layer(stage: Any) -> None:
    """Write a stage's root layer; of a binary one this frees the memory of its time samples.

    Raises:
        OSError: It cannot be written.
    """
    from pxr import Tf

    try:
        saved = stage.GetRootLayer().Save()
    except Tf.ErrorException as error:  # such as for a full disk
        raise OSError("USD could not save the layer: is the disk full?") from error
    if not saved:
        raise OSError("USD could not save the layer")


def _build_stage(cache: Cache, file: Path) -> tuple[Any, Any]:
    """A stage with the mesh at rest, and its ``UsdGeom.Mesh``.

    Raises:
        MissingExtraError: OpenUSD is not installed.
    """
    _pxr()
    from pxr import Tf, UsdGeom, Vt

    surface, clip = cache.surface, cache.clip
    stage = _create(file)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(clip.rate)
    stage.SetFramesPerSecond(clip.rate)
    stage.SetStartTimeCode(clip.start)
    stage.SetEndTimeCode(clip.start + clip.frames - 1)

    mesh = UsdGeom.Mesh.Define(stage, f"/{Tf.MakeValidIdentifier(clip.name)}")
    stage.SetDefaultPrim(mesh.GetPrim())
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(surface.source_faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(surface.source_faces.ravel())))
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(cache.rest))
    mesh.CreateExtentAttr(extent_of(cache.rest))
    write_texture_coordinates(mesh, surface)
    return stage, mesh


def write_texture_coordinates(mesh: Any, surface: Surface) -> None:
    """Write primvar ``st`` of a ``UsdGeom.Mesh``: per vertex, or per corner if the texture has seams."""
    from pxr import Sdf, UsdGeom, Vt

    by_corner = surface.corner_uv is not None
    uv = surface.corner_uv if by_corner else surface.uv
    if uv is None:
        return
    kind = UsdGeom.Tokens.faceVarying if by_corner else UsdGeom.Tokens.vertex
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, kind)
    primvar.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uv.reshape(-1, 2), np.float32)))


def _pxr() -> None:
    try:
        import pxr  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("USD", "usd") from error


def _create(file: Path) -> Any:
    from pxr import Tf, Usd

    file.unlink(missing_ok=True)
    try:
        return Usd.Stage.CreateNew(str(file))
    except Tf.ErrorException as error:
        raise OSError(_last_line(error)) from error


def _last_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or ["it does not say why"])[-1].strip()


def extent_of(vertices: NDArray[np.float32]) -> Any:
    """Corners of the bounding box of positions (n, 3), as USD's extent."""
    from pxr import Vt

    return Vt.Vec3fArray.FromNumpy(np.stack([vertices.min(axis=0), vertices.max(axis=0)]))
