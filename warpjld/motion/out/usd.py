"""Writer of UsdSkel: a SkelRoot with the rig's own joints, a SkelAnimation of their motion, and the skinned surface.

The stage has the units and axes of the rig's own file, so that the two can be overlaid; they are stated by
``metersPerUnit`` and ``upAxis``. If loading placed the rig by more than a unit and an up axis, metres and Y up are
used. A time code is a frame number.

USD stores joint scales as 16-bit floats. A scale that is common to all joints is put on the SkelRoot, which is exact;
otherwise bind and rest transforms are computed with the rounded scales, so that the skin follows exactly, and
translations such that joint positions are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import MissingExtraError
from warpjld.geometry.rotations import upright
from warpjld.io.caches.usd import save_layer, write_texture_coordinates
from warpjld.io.usd.skeletons import concatenated
from warpjld.motion.out.baked_skin import BakedSkin
from warpjld.motion.out.local_motion import local_motion, rest_scales
from warpjld.motion.out.skin_weights import joint_weights
from warpjld.motion.out.source_motion import SourceMotion, source_motion
from warpjld.motion.out.usd_samples import JointSamples
from warpjld.motion.out.write import Timing, WrittenMotion
from warpjld.rig import Rig
from warpjld.skeleton import Poses

__all__ = ["write_usd"]

_SHEARED = 1e-3  # smallest shear that is reported, per scale of the joint
_PENDING = 400_000
"""Transforms in memory after which a binary layer is saved: about 32 MB."""
_SAME = 1e-9  # tolerance of the placing, per unit of the file


def write_usd(path: Path, rig: Rig, poses: Poses, timing: Timing, baked: BakedSkin | None = None) -> WrittenMotion:
    """Write a motion of a rig's own joints as USD; a :class:`~warpjld.motion.out.write.MotionWriter`.

    Args:
        path: The file.
        rig: The rig.
        poses: Poses of its skeleton.
        timing: Frame rate, first frame and name.
        baked: Skin weights that replace the rig's own, with blend shapes.

    Raises:
        MissingExtraError: OpenUSD is not installed.
    """
    try:
        from pxr import Tf, Usd, UsdSkel
    except ImportError as error:
        raise MissingExtraError("USD", "usd") from error
    motion = source_motion(rig, poses)
    space = _space(motion)
    notes = [*motion.notes, f"{space.up} up, {space.metres:g} m a unit, a time code is a frame number"]
    path.unlink(missing_ok=True)
    try:
        stage = Usd.Stage.CreateNew(str(path))
    except Tf.ErrorException as error:
        raise OSError(str(error).strip().splitlines()[-1]) from error
    _head(stage, space, timing, len(motion))
    root = UsdSkel.Root.Define(stage, f"/{Tf.MakeValidIdentifier(rig.name)}")
    stage.SetDefaultPrim(root.GetPrim())
    root.AddScaleOp().Set((space.scale,) * 3)
    skeleton = _skeleton(stage, root, motion, space)
    animation = UsdSkel.Animation.Define(stage, _below(stage, root, timing.name))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    animation.CreateJointsAttr(skeleton.GetJointsAttr().Get())
    text = JointSamples(len(space.order), timing.start_frame) if path.suffix.lower() == ".usda" else None
    sheared = _animate(animation, motion, space, timing.start_frame, stage if text is None else text)
    mesh = _surface(stage, root, skeleton, rig, motion, space, baked, notes)
    if baked is not None and baked.names:
        _blend_shapes(stage, mesh, animation, rig, space, baked, timing.start_frame)
    save_layer(stage)
    if text is not None:
        del stage  # its layer is the file that is replaced
        text.insert(path)
    bent = [motion.tree.names[j] for j in np.flatnonzero(sheared > _SHEARED)]
    warning = (
        f"{len(bent)} joints are below one scaled by different factors ({', '.join(bent[:4])}): USD cannot hold the "
        f"shear of their turns, up to {100 * sheared.max():.1f} % of their scale; their positions are exact"
    )
    return WrittenMotion(tuple(notes), (warning,) if bent else ())


@dataclass(frozen=True, eq=False)
class _Space:
    """Units and axes of the stage, and its N joints, parents first.

    Attributes:
        metres: Metres per unit.
        up: ``Y`` or ``Z``.
        scale: Scale of the SkelRoot.
        to_rig: Skeleton space → the rig's metres with Y up, shape (4, 4).
        order: Index of each joint in the rig's file, shape (N,).
        parents: Parent of every joint in this order, -1 for none, shape (N,).
        local: Joint-to-parent transforms at rest, shape (N, 4, 4).
        scales: Scale in ``local``, shape (N, 3).
    """

    metres: float
    up: str
    scale: float
    to_rig: NDArray[np.float64]
    order: NDArray[np.int64]
    parents: NDArray[np.int64]
    local: NDArray[np.float64]
    scales: NDArray[np.float64]

    @property
    def bind(self) -> NDArray[np.float64]:
        """Joint-to-skeleton transforms at rest, shape (N, 4, 4)."""
        return concatenated(self.local, self.parents)


def _space(motion: SourceMotion) -> _Space:
    metres, up, to_rig = 1.0, "Y", np.eye(4)
    unit = float(np.cbrt(np.linalg.det(motion.placing[:3, :3])))
    for axis, turn in (("Y", upright("y")), ("Z", upright("z"))):
        plain = np.eye(4)
        plain[:3, :3] = unit * turn
        if np.abs(motion.placing - plain).max() <= _SAME * abs(unit):
            metres, up, to_rig = unit, axis, plain
    frames = np.linalg.inv(to_rig) @ motion.rest_frames
    lengths = np.linalg.norm(frames[:, :3, :3], axis=1)
    scale = float(lengths.mean())
    if not np.abs(lengths - scale).max() <= 1e-6 * scale:
        scale = 1.0
    root = np.diag([scale, scale, scale, 1.0])
    depth = [motion.tree.depth(j) for j in range(len(motion.tree))]
    in_order = (motion.tree.parents < np.arange(len(depth))).all()
    order = np.arange(len(depth)) if in_order else np.argsort(depth, kind="stable")
    parents = motion.tree.parents[order]
    parents = np.where(parents < 0, -1, np.argsort(order)[parents])
    local, scales = _rest((np.linalg.inv(root) @ frames)[order], parents)
    return _Space(metres, up, scale, to_rig @ root, order, parents, local, scales)


def _rest(frames: NDArray[np.float64], parents: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Joint-to-parent transforms with scales rounded as USD stores them, and those scales."""
    local = frames.copy()
    hang = parents >= 0
    local[hang] = np.linalg.solve(frames[parents[hang]], frames[hang])
    scales = rest_scales(local).astype(np.float16).astype(np.float64)
    split = local_motion(frames[None], parents, local, scales, np.ones(len(frames), dtype=bool))
    out = np.tile(np.eye(4), (len(frames), 1, 1))
    out[:, :3, :3] = Rotation.from_quat(split.rotations[0]).as_matrix() * scales[:, None, :]
    out[:, :3, 3] = split.translations[0]
    return out, scales


def _head(stage: Any, space: _Space, timing: Timing, frames: int) -> None:
    from pxr import UsdGeom

    UsdGeom.SetStageUpAxis(stage, space.up)
    UsdGeom.SetStageMetersPerUnit(stage, space.metres)
    stage.SetTimeCodesPerSecond(timing.rate)
    stage.SetFramesPerSecond(timing.rate)
    stage.SetStartTimeCode(timing.start_frame)
    stage.SetEndTimeCode(timing.start_frame + frames - 1)


def _below(stage: Any, root: Any, name: str) -> Any:
    """An unused path below the root, from a name made a valid identifier."""
    from pxr import Tf

    chosen = Tf.MakeValidIdentifier(name)
    while stage.GetPrimAtPath(path := root.GetPath().AppendChild(chosen)):
        chosen += "_"
    return path


def _skeleton(stage: Any, root: Any, motion: SourceMotion, space: _Space) -> Any:
    from pxr import Gf, UsdSkel, Vt

    def rows(transforms: NDArray[np.float64]) -> Any:
        return Vt.Matrix4dArray([Gf.Matrix4d(m.T.tolist()) for m in transforms])

    skeleton = UsdSkel.Skeleton.Define(stage, _below(stage, root, "Skeleton"))
    names = [motion.tree.names[j] for j in space.order]
    skeleton.CreateJointsAttr(_tokens(names, space.parents))
    skeleton.CreateJointNamesAttr(names)
    skeleton.CreateBindTransformsAttr(rows(space.bind))
    skeleton.CreateRestTransformsAttr(rows(space.local))
    return skeleton


def _tokens(names: list[str], parents: NDArray[np.int64]) -> list[str]:
    """USD's joint tokens, parents first: unique paths of identifiers."""
    from pxr import Tf

    out: list[str] = []
    for name, parent in zip(names, parents.tolist(), strict=True):
        above = f"{out[parent]}/" if parent >= 0 else ""
        token = above + Tf.MakeValidIdentifier(name.rpartition("/")[2])
        while token in out:
            token += "_"
        out.append(token)
    return out


def _animate(
    animation: Any, motion: SourceMotion, space: _Space, start: int, into: Any | JointSamples
) -> NDArray[np.float64]:
    """Write samples of all frames; returns the shear that is lost, as ``LocalMotion.sheared``.

    Args:
        animation: The ``SkelAnimation``.
        motion: The motion.
        space: Joints at rest.
        start: Time code of the first frame.
        into: The stage, if it is binary: it is saved every few thousand frames, which frees their memory. Of a text
            only the first frame is written to the stage, and all are left to be inserted.
    """
    from pxr import Vt

    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    animation.CreateScalesAttr(Vt.Vec3hArray.FromNumpy(space.scales.astype(np.float16)))
    given = np.ones(len(space.order), dtype=bool)
    sheared = np.zeros(len(given))
    last = np.tile([0.0, 0.0, 0.0, 1.0], (len(given), 1))
    back, bind, pending = np.linalg.inv(space.to_rig), space.bind, 0
    for block in motion.blocks():
        worlds = back @ motion.moves(block)[:, space.order] @ space.to_rig @ bind
        local = local_motion(worlds, space.parents, space.local, space.scales, given)
        sheared = np.maximum(sheared, local.sheared)
        for frame, (move, turn) in enumerate(zip(local.translations, local.rotations, strict=True)):
            # consecutive quaternions on the same hemisphere, for programs that interpolate components
            last = np.where((turn * last).sum(axis=-1, keepdims=True) < 0.0, -turn, turn)
            time = start + block.start + frame
            if isinstance(into, JointSamples):
                into.add(move, last)
                if time > start:
                    continue
            translations.Set(Vt.Vec3fArray.FromNumpy(move.astype(np.float32)), time)
            rotations.Set(Vt.QuatfArray.FromNumpy(last.astype(np.float32)), time)
        pending += len(local.translations) * len(given)
        if pending > _PENDING and not isinstance(into, JointSamples):
            save_layer(into)
            pending = 0
    return sheared


def _surface(
    stage: Any,
    root: Any,
    skeleton: Any,
    rig: Rig,
    motion: SourceMotion,
    space: _Space,
    baked: BakedSkin | None,
    notes: list[str],
) -> Any:
    """Write the surface at rest in its source's vertex order, bound to the joints."""
    from pxr import Gf, UsdGeom, UsdSkel, Vt

    surface = rig.surface
    back = np.linalg.inv(space.to_rig)
    points = (surface.vertices @ back[:3, :3].T + back[:3, 3])[surface.weld].astype(np.float32)
    mesh = UsdGeom.Mesh.Define(stage, _below(stage, root, "Surface"))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mirrored = np.linalg.det(back[:3, :3]) < 0.0
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded if mirrored else UsdGeom.Tokens.rightHanded)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(surface.source_faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(surface.source_faces.ravel())))
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    write_texture_coordinates(mesh, surface)
    joints, weights = joint_weights(rig, motion, notes) if baked is None else (baked.joints, baked.weights)
    joints, weights = np.argsort(space.order)[joints][surface.weld], weights[surface.weld]
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr().Set(Gf.Matrix4d(1.0))
    width = joints.shape[1]
    binding.CreateJointIndicesPrimvar(False, width).Set(Vt.IntArray.FromNumpy(joints.astype(np.int32).ravel()))
    binding.CreateJointWeightsPrimvar(False, width).Set(Vt.FloatArray.FromNumpy(weights.astype(np.float32).ravel()))
    return mesh


def _blend_shapes(stage: Any, mesh: Any, animation: Any, rig: Rig, space: _Space, baked: BakedSkin, start: int) -> None:
    """Write shapes below the mesh, and their weights over time in the animation."""
    from pxr import UsdSkel, Vt

    back = np.linalg.inv(space.to_rig)[:3, :3]
    targets = []
    for name, shape in zip(baked.names, baked.shapes, strict=True):
        target = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(name))
        offsets = (shape @ back.T)[rig.surface.weld].astype(np.float32)
        target.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(offsets))
        targets.append(target.GetPath())
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    binding.CreateBlendShapesAttr(list(baked.names))
    binding.CreateBlendShapeTargetsRel().SetTargets(targets)
    animation.CreateBlendShapesAttr(list(baked.names))
    weights = animation.CreateBlendShapeWeightsAttr()
    for frame, row in enumerate(baked.over_time):
        weights.Set(Vt.FloatArray.FromNumpy(row.astype(np.float32)), start + frame)
