"""Joint influences and blend shapes of a skinned UsdSkel mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.usd.mesh import default_or_first
from warpjld.io.usd.skeletons import UsdSkeleton
from warpjld.io.usd.stage import UsdFile

__all__ = ["Influences", "blended_points", "read_usd_influences"]

Influences = tuple[NDArray[np.int64], NDArray[np.float64], int]
"""Joints of the whole tree and weights per vertex, shape (V, K), unused slots with weight 0 and rows summing to one;
and the joint that the whole mesh follows rigidly, or -1."""


def read_usd_influences(
    file: UsdFile, skeleton: UsdSkeleton, query: Any, points: NDArray[np.float64], where: str
) -> Influences:
    """``primvars:skel:jointIndices`` and ``jointWeights`` of a mesh, mapped from its own joint order.

    Raises:
        InputError: Sizes that do not match, joints that the skeleton lacks, or invalid weights.
    """
    width = query.GetNumInfluencesPerComponent()
    index = _flat(query.GetJointIndicesPrimvar(), np.int64)
    weight = _flat(query.GetJointWeightsPrimvar(), np.float64)
    constant = query.IsRigidlyDeformed()
    rows = 1 if constant else len(points)
    if width < 1 or len(index) != rows * width or len(weight) != rows * width:
        raise InputError(
            f"{where}: {len(index)} joint indices and {len(weight)} weights are not {width} for each of {rows} "
            f"{'mesh' if constant else 'vertices'}",
            path=file.path,
        )
    index, weight = index.reshape(rows, width), weight.reshape(rows, width)
    if not (np.isfinite(weight) & (weight >= 0.0)).all():
        bad = int(np.argwhere(~(np.isfinite(weight) & (weight >= 0.0)))[0][0])
        raise InputError(f"{where}: vertex {bad} has a negative or non-finite weight", path=file.path)
    order = _joint_numbers(file, skeleton, query, where)
    index = np.where(weight > 0.0, index, 0)
    if not ((index >= 0) & (index < len(order))).all():
        bad = int(np.argwhere((index < 0) | (index >= len(order)))[0][0])
        raise InputError(
            f"{where}: vertex {bad} follows joint {index[bad].max()}, there are {len(order)}", path=file.path
        )
    used = order[index]
    if (lacking := (used < 0) & (weight > 0.0)).any():
        token = query.GetJointOrder()[int(index[lacking][0])]
        raise InputError(f"{where}: it follows joint '{token}', which skeleton '{skeleton.path}' lacks", path=file.path)
    used, weight = _normalised(file, np.maximum(used, 0) + skeleton.first, weight, points, where)
    if not constant:
        return used, weight, -1
    rigid = int(used[0, weight[0].argmax()]) if (weight[0] > 0.0).sum() == 1 else -1
    return np.repeat(used, len(points), axis=0), np.repeat(weight, len(points), axis=0), rigid


def blended_points(file: UsdFile, skeleton: UsdSkeleton, query: Any, points: Any) -> NDArray[np.float64]:
    """Points with blend shapes at the default weights of the bound animation (not time samples), shape (V, 3).

    Args:
        file: The stage.
        skeleton: The skeleton that the mesh is bound to.
        query: The mesh's skinning query.
        points: Points without blend shapes, shape (V, 3).
    """
    from pxr import UsdSkel, Vt

    animation = skeleton.animation
    if not (query.HasBlendShapes() and animation):
        return np.asarray(points)
    attribute = UsdSkel.Animation(animation).GetBlendShapeWeightsAttr()
    weights = attribute.Get()
    if attribute.GetNumTimeSamples():
        file.notes.append(f"mesh '{query.GetPrim().GetPath()}': its blend shapes move, which is not followed")
    if weights is None or query.GetBlendShapeMapper() is None:
        return np.asarray(points)
    own = query.GetBlendShapeMapper().Remap(weights)
    if own is None or not np.any(own):
        return np.asarray(points)
    shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(query.GetPrim()))
    sub = shapes.ComputeSubShapeWeights(own)
    moved = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, dtype=np.float32))
    shapes.ComputeDeformedPoints(
        *sub, shapes.ComputeBlendShapePointIndices(), shapes.ComputeSubShapePointOffsets(), moved
    )
    return np.array(moved, dtype=np.float64)


def _flat(primvar: Any, kind: type) -> NDArray[Any]:
    from pxr import Usd

    value = primvar.ComputeFlattened()
    if value is None:
        value = primvar.ComputeFlattened(Usd.TimeCode.EarliestTime())
    return np.array(() if value is None else value, dtype=kind)


def _joint_numbers(file: UsdFile, skeleton: UsdSkeleton, query: Any, where: str) -> NDArray[np.int64]:
    """Joint of the skeleton for each joint of the mesh's own order, -1 for missing ones."""
    from pxr import UsdSkel

    own = query.GetJointOrder()
    if not own:
        own = default_or_first(UsdSkel.BindingAPI(query.GetPrim()).GetJointsAttr())
    if not own:
        return np.arange(len(skeleton.tokens))
    number = {token: j for j, token in enumerate(skeleton.tokens)}
    return np.array([number.get(str(token), -1) for token in own])


def _normalised(
    file: UsdFile, index: NDArray[np.int64], weight: NDArray[np.float64], points: NDArray[np.float64], where: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Normalised weights; unweighted vertices get those of the nearest weighted one."""
    total = weight.sum(axis=1)
    bare = total <= 0.0
    if bare.all():
        raise InputError(f"{where}: no vertex has any weight", path=file.path)
    if bare.any():
        from scipy.spatial import cKDTree  # it takes longer to import than OpenUSD, and is seldom needed

        nearest = np.flatnonzero(~bare)[cKDTree(points[~bare]).query(points[bare])[1]]
        index, weight = index.copy(), weight.copy()
        index[bare], weight[bare], total[bare] = index[nearest], weight[nearest], total[nearest]
        file.notes.append(f"{where}: {int(bare.sum())} vertices have no weight: they follow the nearest that has")
    if (off := np.abs(total - 1.0) > 0.01).any():
        file.notes.append(f"{where}: weights of {int(off.sum())} vertices did not sum to one, normalised")
    return index, weight / total[:, None]
