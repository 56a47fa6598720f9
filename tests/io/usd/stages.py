"""UsdSkel stages made from arrays with pxr, with the liberties that USD allows. Column vectors in, as everywhere."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass
class Keys:
    """Joint-to-parent transforms of an animation at time codes, of all joints in order where ``joints`` is None."""

    times: list[float]
    translations: np.ndarray  # (T, J, 3)
    rotations: np.ndarray  # (T, J, 4) x y z w
    scales: np.ndarray | None = None
    joints: list[int] | None = None
    name: str = "Animation"
    bound: bool = True


@dataclass
class Stage:
    """Content of a stage; what is left alone takes the plainest form."""

    names: list[str]
    parents: list[int]
    frames: np.ndarray  # (J, 4, 4) joint to skeleton at bind
    vertices: np.ndarray
    faces: np.ndarray | list[list[int]]
    joints: np.ndarray | None = None  # (W, K)
    weights: np.ndarray | None = None
    rest: np.ndarray | None = None  # (J, 4, 4) joint to skeleton; the bind pose by default
    uv: np.ndarray | None = None
    uv_interpolation: str = "vertex"
    uv_indices: np.ndarray | None = None
    constant: bool = False
    mesh_joints: list[int] | None = None  # the mesh's own order of joints
    geom_bind: np.ndarray = field(default_factory=lambda: np.eye(4))
    place: np.ndarray = field(default_factory=lambda: np.eye(4))  # of the SkelRoot
    left_handed: bool = False
    holes: list[int] | None = None
    metres: float | None = 1.0
    up: str | None = "Y"
    rate: float = 24.0
    span: tuple[float, float] | None = None
    keys: list[Keys] = field(default_factory=list)
    shapes: dict[str, tuple[np.ndarray, float | None]] = field(default_factory=dict)  # offsets, default weight
    with_bind: bool = True
    with_mesh: bool = True

    def write(self, path: Path) -> Path:
        """Write the stage, one SkelRoot at /World/Rig."""
        from pxr import Usd

        stage = Usd.Stage.CreateInMemory()
        self.define(stage, "/World/Rig")
        self.head(stage)
        stage.GetRootLayer().Export(str(path))
        return path

    def head(self, stage: Any) -> None:
        """Units, axes and time of a stage."""
        from pxr import UsdGeom

        if self.metres is not None:
            UsdGeom.SetStageMetersPerUnit(stage, self.metres)
        if self.up is not None:
            UsdGeom.SetStageUpAxis(stage, self.up)
        stage.SetTimeCodesPerSecond(self.rate)
        if self.span is not None:
            stage.SetStartTimeCode(self.span[0])
            stage.SetEndTimeCode(self.span[1])

    def tokens(self) -> list[str]:
        """USD's names of the joints: their paths."""
        out: list[str] = []
        for name, parent in zip(self.names, self.parents, strict=True):
            out.append(name if parent < 0 else f"{out[parent]}/{name}")
        return out

    def define(self, stage: Any, root: str) -> None:
        """The SkelRoot at a path of a stage."""
        from pxr import Gf, UsdSkel, Vt

        tokens = self.tokens()
        skel_root = UsdSkel.Root.Define(stage, root)
        skel_root.AddTransformOp().Set(gf(self.place))
        skeleton = UsdSkel.Skeleton.Define(stage, f"{root}/Skeleton")
        skeleton.CreateJointsAttr(tokens)
        if self.with_bind:
            skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([gf(m) for m in self.frames]))
        skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([gf(m) for m in self.local_rest()]))
        binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
        for keys in self.keys:
            animation = UsdSkel.Animation.Define(stage, f"{root}/{keys.name}")
            animation.CreateJointsAttr(tokens if keys.joints is None else [tokens[j] for j in keys.joints])
            count = len(tokens) if keys.joints is None else len(keys.joints)
            scales = np.ones((len(keys.times), count, 3)) if keys.scales is None else keys.scales
            for time, move, turn, scale in zip(keys.times, keys.translations, keys.rotations, scales, strict=True):
                animation.CreateTranslationsAttr().Set(Vt.Vec3fArray.FromNumpy(np.float32(move)), time)
                quats = Vt.QuatfArray([Gf.Quatf(float(q[3]), *map(float, q[:3])) for q in turn])
                animation.CreateRotationsAttr().Set(quats, time)
                animation.CreateScalesAttr().Set(Vt.Vec3hArray.FromNumpy(np.float16(scale)), time)
            if keys.bound:
                binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
        if self.with_mesh:
            self._mesh(stage, root, skeleton)

    def local_rest(self) -> np.ndarray:
        """Joint-to-parent transforms at rest."""
        rest = self.frames if self.rest is None else self.rest
        local = [m if p < 0 else np.linalg.inv(rest[p]) @ m for m, p in zip(rest, self.parents, strict=True)]
        return np.array(local).reshape(-1, 4, 4)

    def _mesh(self, stage: Any, root: str, skeleton: Any) -> None:
        from pxr import Sdf, UsdGeom, UsdSkel, Vt

        mesh = UsdGeom.Mesh.Define(stage, f"{root}/Mesh")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.float32(self.vertices)))
        faces = [list(map(int, face)) for face in self.faces]
        mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
        mesh.CreateFaceVertexIndicesAttr([v for face in faces for v in face])
        if self.left_handed:
            mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
        if self.holes:
            mesh.CreateHoleIndicesAttr(self.holes)
        if self.uv is not None:
            st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
                "st", Sdf.ValueTypeNames.TexCoord2fArray, self.uv_interpolation
            )
            st.Set(Vt.Vec2fArray.FromNumpy(np.float32(self.uv)))
            if self.uv_indices is not None:
                st.SetIndices(Vt.IntArray.FromNumpy(np.int32(self.uv_indices)))
        if self.joints is None:
            return
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        binding.CreateGeomBindTransformAttr(gf(self.geom_bind))
        joints = self.joints
        if self.mesh_joints is not None:
            tokens = self.tokens()
            binding.CreateJointsAttr([tokens[j] for j in self.mesh_joints])
            joints = np.argsort(self.mesh_joints)[joints]
        width = joints.shape[1]
        binding.CreateJointIndicesPrimvar(self.constant, width).Set(Vt.IntArray.FromNumpy(np.int32(joints.ravel())))
        binding.CreateJointWeightsPrimvar(self.constant, width).Set(
            Vt.FloatArray.FromNumpy(np.float32(self.weights.ravel()))
        )
        if self.shapes:
            targets = []
            for name, (offsets, _) in self.shapes.items():
                shape = UsdSkel.BlendShape.Define(stage, f"{root}/Mesh/{name}")
                moved = np.flatnonzero(np.abs(offsets).max(axis=1) > 0.0)
                shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.float32(offsets[moved])))
                shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(np.int32(moved)))
                targets.append(shape.GetPath())
            binding.CreateBlendShapesAttr(list(self.shapes))
            binding.CreateBlendShapeTargetsRel().SetTargets(targets)
            (keys,) = self.keys
            animation = UsdSkel.Animation.Get(stage, f"{root}/{keys.name}")
            animation.CreateBlendShapesAttr(list(self.shapes))
            weights = [weight for _, weight in self.shapes.values()]
            if all(weight is not None for weight in weights):
                animation.CreateBlendShapeWeightsAttr(weights)
            else:
                animation.CreateBlendShapeWeightsAttr().Set([1.0] * len(weights), 1.0)


def gf(matrix: np.ndarray) -> Any:
    """Column-vector matrix → Gf.Matrix4d."""
    from pxr import Gf

    return Gf.Matrix4d(np.ascontiguousarray(np.asarray(matrix, dtype=np.float64).T))


def transform(
    move: tuple[float, float, float] = (0.0, 0.0, 0.0),
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    scale: float = 1.0,
) -> np.ndarray:
    """Scale, then rotation vector [rad], then translation."""
    out = np.eye(4)
    out[:3, :3] = scale * Rotation.from_rotvec(turn).as_matrix()
    out[:3, 3] = move
    return out


def instanced(stage: Stage, path: Path, places: dict[str, np.ndarray]) -> Path:
    """A stage whose only content are instances of one SkelRoot."""
    from pxr import Usd, UsdGeom

    prototype = path.with_name(f"{path.stem}.prototype.usda")
    stage.write(prototype)
    out = Usd.Stage.CreateInMemory()
    stage.head(out)
    for name, place in places.items():
        prim = UsdGeom.Xform.Define(out, f"/{name}")
        prim.AddTransformOp().Set(gf(place))
        prim.GetPrim().GetReferences().AddReference(str(prototype.resolve()), "/World")
        prim.GetPrim().SetInstanceable(True)
    out.GetRootLayer().Export(str(path))
    return path


__all__ = ["Keys", "Stage", "gf", "instanced", "replace", "transform"]
