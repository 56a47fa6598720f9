"""Reader of UsdSkel rigs as :class:`SourceRig`: joints of all skeletons, skinned meshes in bind pose."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.io.rig_meshes import RigMesh, joined
from warpjld.io.source import SourceRig
from warpjld.io.usd.influences import blended_points, read_usd_influences
from warpjld.io.usd.mesh import read_usd_mesh
from warpjld.io.usd.skeletons import UsdSkeleton, UsdSkeletons, read_skeletons
from warpjld.io.usd.stage import UsdFile, open_usd, usd_matrices
from warpjld.io.usd.texture import usd_texture

__all__ = ["read_usd_rig"]


def read_usd_rig(path: str | Path) -> SourceRig:
    """Read the skinned meshes of a USD stage at their bind pose.

    A vertex is at to-world · geomBindTransform · point, with the skeleton's transform as to-world: a skinned mesh's own
    transform is ignored. Blend shapes have the animation's default weights. Meshes without joints, invisible ones and
    guides are left out, with a note.

    Raises:
        InputError: Not a USD file, no skeleton, or invalid skin data.
        MissingExtraError: OpenUSD is not installed.
    """
    with open_usd(path) as file:
        found = read_skeletons(file)
        if found is None:
            raise InputError("has no joints: give a skeleton file for this surface", path=file.path)
        meshes = _meshes(file, found)
    if not meshes:
        raise InputError("no visible mesh uses its skeleton: this is an animation, or a skeleton alone", path=file.path)
    return SourceRig(
        path=file.path,
        tree=found.tree,
        **joined(meshes),
        metres=file.metres,
        up=file.up,
        notes=tuple(dict.fromkeys(file.notes)),
    )


def _meshes(file: UsdFile, found: UsdSkeletons) -> list[RigMesh]:
    from pxr import UsdGeom

    out = []
    skinned: set[str] = set()
    for skeleton in found.skeletons:
        for query in skeleton.meshes:
            prim = query.GetPrim()
            skinned.add(str(prim.GetPath()))
            if not prim.IsA(UsdGeom.Mesh):
                file.notes.append(f"'{prim.GetPath()}' is skinned, but no mesh: left out")
            elif reason := _hidden(prim):
                file.notes.append(f"mesh '{prim.GetPath()}' {reason}: left out")
            elif not query.HasJointInfluences():
                file.notes.append(f"mesh '{prim.GetPath()}' has no joint weights: left out")
            elif (mesh := _skinned(file, skeleton, query)) is not None:
                out.append(mesh)
    for prim in file.prims():
        if prim.IsA(UsdGeom.Mesh) and str(prim.GetPath()) not in skinned:
            file.notes.append(f"mesh '{prim.GetPath()}' is bound to no joint: left out")
    return out


def _hidden(prim: Any) -> str:
    """Why a mesh is not displayed by the stage, for the user; "" if it is."""
    from pxr import Usd, UsdGeom

    imageable = UsdGeom.Imageable(prim)
    purpose = imageable.ComputePurpose()
    if purpose in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
        return f"is there as {purpose} only"
    if imageable.ComputeVisibility(Usd.TimeCode.EarliestTime()) == UsdGeom.Tokens.invisible:
        return "is invisible"
    return ""


def _skinned(file: UsdFile, skeleton: UsdSkeleton, query: Any) -> RigMesh | None:
    prim = query.GetPrim()
    where = f"mesh '{prim.GetPath()}'"
    mesh = read_usd_mesh(file, prim)
    if not len(mesh.faces):
        file.notes.append(f"{where} has no faces: left out")
        return None
    with np.errstate(invalid="ignore"):
        place = skeleton.to_world @ usd_matrices(query.GetGeomBindTransform())
    joints, weights, rigid = read_usd_influences(file, skeleton, query, mesh.points, where)
    points = blended_points(file, skeleton, query, mesh.points)
    with np.errstate(invalid="ignore", over="ignore"):
        vertices = points @ place[:3, :3].T + place[:3, 3]
    if not np.isfinite(vertices).all():
        raise InputError(f"{where}: its geomBindTransform or a blend shape is not finite", path=file.path)
    turned_inside_out = np.linalg.det(place[:3, :3]) < 0.0
    order = slice(None, None, -1 if turned_inside_out else 1)
    return RigMesh(
        name=prim.GetName(),
        vertices=vertices,
        faces=mesh.faces[:, order],
        corner_uv=None if mesh.uv is None else mesh.uv[:, order],
        joints=joints,
        weights=weights,
        rigid=rigid,
        polygons=mesh.polygons,
        polygon_count=mesh.polygon_count,
        texture=None if mesh.uv is None else usd_texture(file, prim),
    )
