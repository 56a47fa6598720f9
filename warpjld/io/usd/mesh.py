"""Triangulation of UsdGeom meshes, with texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.polygons import triangulate_polygons
from warpjld.io.usd.stage import UsdFile

__all__ = ["UsdMesh", "default_or_first", "read_usd_mesh"]


@dataclass(frozen=True, eq=False)
class UsdMesh:
    """A mesh in local coordinates.

    Attributes:
        points: Vertex positions, shape (V, 3).
        faces: Triangles, anticlockwise seen from outside, shape (S, 3).
        uv: Texture coordinates of every triangle's corners, shape (S, 3, 2), or None.
        polygons: Face of the file that each triangle is part of, shape (S,).
        polygon_count: Number of faces in the file.
    """

    points: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    polygons: NDArray[np.int64]
    polygon_count: int


def read_usd_mesh(file: UsdFile, prim: Any) -> UsdMesh:
    """The control mesh of a ``UsdGeom.Mesh`` at its default time, regardless of its subdivision scheme.

    Raises:
        InputError: Points that are missing or not finite, or faces that do not match them.
    """
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    where = f"mesh '{prim.GetPath()}'"
    points = np.array(default_or_first(mesh.GetPointsAttr()) or np.zeros((0, 3)), dtype=np.float64).reshape(-1, 3)
    counts = np.array(default_or_first(mesh.GetFaceVertexCountsAttr()) or (), dtype=np.int64)
    indices = np.array(default_or_first(mesh.GetFaceVertexIndicesAttr()) or (), dtype=np.int64)
    if not np.isfinite(points).all():
        bad = int(np.argwhere(~np.isfinite(points))[0][0])
        raise InputError(f"{where}: vertex {bad} is not finite", path=file.path)
    if (counts < 0).any() or counts.sum() != len(indices):
        raise InputError(
            f"{where}: its faceVertexCounts ask for {counts.sum()} corners, faceVertexIndices has {len(indices)}",
            path=file.path,
        )
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        bad = int(indices[(indices < 0) | (indices >= len(points))][0])
        raise InputError(f"{where}: face index {bad} is beyond its {len(points)} vertices", path=file.path)
    corners, owner = triangulate_polygons(points[indices], counts)
    holes = mesh.GetHoleIndicesAttr().Get()
    if holes:
        filled = ~np.isin(owner, np.array(holes))
        corners, owner = corners[filled], owner[filled]
    if (counts < 3).any():
        file.notes.append(f"{where}: {int((counts < 3).sum())} faces with fewer than three corners left out")
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corners = corners[:, ::-1]
    uv = _corner_uv(file, prim, where, indices)
    return UsdMesh(points, indices[corners], None if uv is None else uv[corners], owner, len(counts))


def default_or_first(attribute: Any) -> Any:
    """An attribute's default value, or its first time sample if it has none."""
    from pxr import Usd

    value = attribute.Get()
    return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value


def _corner_uv(file: UsdFile, prim: Any, where: str, indices: NDArray[np.int64]) -> NDArray[np.float32] | None:
    """Texture coordinates of all polygons' corners, shape (C, 2)."""
    from pxr import Sdf, Usd, UsdGeom

    primvars = UsdGeom.PrimvarsAPI(prim)
    textured = [one for one in primvars.FindPrimvarsWithInheritance() if _is_uv(one.GetTypeName(), Sdf)]
    if not textured:
        return None
    primvar = next((one for one in textured if one.GetPrimvarName() == "st"), textured[0])
    time = Usd.TimeCode.EarliestTime() if primvar.Get() is None else Usd.TimeCode.Default()
    flat = primvar.ComputeFlattened(time)
    values = np.array(flat or np.zeros((0, 2)), dtype=np.float32).reshape(-1, 2)
    kind = primvar.GetInterpolation()
    if kind == UsdGeom.Tokens.faceVarying:
        wanted, corner = len(indices), np.arange(len(indices))
    elif kind in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying):
        wanted, corner = int(indices.max(initial=-1)) + 1, indices
    else:
        file.notes.append(f"{where}: texture coordinates '{primvar.GetPrimvarName()}' are {kind}: left out")
        return None
    if len(values) < wanted or not np.isfinite(values).all():
        file.notes.append(f"{where}: texture coordinates do not fit its faces, or are not finite: left out")
        return None
    return values[corner]


def _is_uv(kind: Any, sdf: Any) -> bool:
    names = sdf.ValueTypeNames
    return kind in (names.TexCoord2fArray, names.TexCoord2dArray, names.TexCoord2hArray, names.Float2Array)
