"""UsdSkel files written: read by OpenUSD's own skinning, and read back as rig and motion."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError, MissingExtraError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.out import write_motion
from warpjld.motion.out.skin_weights import joint_weights
from warpjld.motion.out.source_motion import source_motion
from warpjld.rig import Rig
from warpjld.skeleton import Poses, poses_from_rotations

pytest.importorskip("pxr")

POSITION, ROTATION = 1e-6, 1e-5  # of joints and vertices [m], [rad]: USD holds float32

RATE, START, FRAMES = 25.0, 7, 6


def moving(rig: Rig, seed: int = 0) -> Poses:
    """Every joint turned a little further at every frame, and the whole carried along."""
    count = len(rig.skeleton)
    step = np.random.default_rng(seed).normal(0.0, 0.1, (count, 3))
    turns = Rotation.from_rotvec((np.arange(FRAMES)[:, None, None] * step).reshape(-1, 3))
    poses = poses_from_rotations(rig.skeleton, turns.as_quat().reshape(FRAMES, count, 4))
    return replace(poses, positions=poses.positions + np.arange(FRAMES)[:, None, None] * [0.01, 0.02, -0.01])


def armature(scale: float, joint_scales: bool) -> Callable[[Any], Any]:
    """The joints of a glTF file under a scaled node; scales of their own, in thirds, for some of them."""

    def change(glb: Any) -> Any:
        top = np.eye(4)
        top[:3, :3] *= scale
        frames = glb.frames.copy()
        frames[:, :3, 3] /= scale
        if joint_scales:
            frames[3:9, :3, :3] *= 1.0 / 3.0
        return replace(glb, armature=top, frames=frames, vertices=glb.vertices)

    return change


def same_poses(a: Poses, b: Poses) -> None:
    np.testing.assert_allclose(a.positions, b.positions, atol=POSITION)
    turned = Rotation.from_quat(a.rotations.reshape(-1, 4)).inv() * Rotation.from_quat(b.rotations.reshape(-1, 4))
    assert turned.magnitude().max() < ROTATION


def check(path: Path, rig: Rig, poses: Poses) -> None:
    """Joints and skin by OpenUSD against the motion asked for; then our own reading."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage = Usd.Stage.Open(str(path))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (START, START + FRAMES - 1)
    assert stage.GetTimeCodesPerSecond() == RATE
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    query, (mesh,) = cache.GetSkelQuery(binding.GetSkeleton()), binding.GetSkinningTargets()
    assert query.HasBindPose()
    assert query.HasRestPose()
    motion = source_motion(rig, poses)
    names = list(UsdSkel.Skeleton(query.GetPrim()).GetJointNamesAttr().Get())
    order = [names.index(name) for name in motion.tree.names]
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    to_rig = np.diag([metres, metres, metres, 1.0])
    if UsdGeom.GetStageUpAxis(stage) == "Z":
        to_rig[:3, :3] = to_rig[:3, :3] @ Rotation.from_euler("x", -90, degrees=True).as_matrix()
    joints, weights = joint_weights(rig, motion, [])
    rest = np.column_stack([rig.surface.vertices, np.ones(len(rig.surface.vertices))])
    bent = np.einsum("vk,fvkab,vb->fva", weights, motion.moves()[:, joints], rest)[:, rig.surface.weld, :3]
    for frame in range(FRAMES):
        world = UsdGeom.XformCache(START + frame)
        shown = np.array(query.ComputeJointWorldTransforms(world)).swapaxes(1, 2)[order]
        np.testing.assert_allclose((to_rig @ shown)[:, :3, 3], motion.positions()[frame], atol=POSITION)
        points = UsdGeom.Mesh(mesh.GetPrim()).GetPointsAttr().Get()
        assert mesh.ComputeSkinnedPoints(query.ComputeSkinningTransforms(START + frame), points, START + frame)
        place = to_rig @ np.array(world.GetLocalToWorldTransform(query.GetPrim())).T
        placed = np.array(points, dtype=np.float64) @ place[:3, :3].T + place[:3, 3]
        np.testing.assert_allclose(placed, bent[frame], atol=2 * POSITION)
    faces = UsdGeom.Mesh(mesh.GetPrim()).GetFaceVertexIndicesAttr().Get()
    np.testing.assert_array_equal(np.reshape(faces, (-1, 3)), rig.surface.source_faces)

    again = load_rig(path, side="left")
    assert again.source.names == tuple(names)
    assert set(again.skeleton.names) == set(rig.skeleton.names)
    np.testing.assert_allclose(
        again.surface.to_source(again.surface.vertices), rig.surface.to_source(rig.surface.vertices), atol=POSITION
    )
    moved = load_motion(path, again)
    back, rate = moved.poses, moved.rate
    assert rate == RATE
    where = [again.skeleton.index(name) for name in rig.skeleton.names]
    same_poses(Poses(back.positions[:, where], back.rotations[:, where], back.flexion[:, where]), poses)


@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc"])
def test_a_made_rig(hands: dict[str, Rig], tmp_path: Path, suffix: str) -> None:
    rig = replace(hands["left"])
    poses = moving(rig)
    path = tmp_path / f"a.{suffix}"
    written = write_motion(path, rig, poses, rate=RATE, start_frame=START, name="9 wave!")
    assert any("no painted weights" in note for note in written.notes)
    assert written.warnings == ()
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    check(path, rig, poses)


@pytest.mark.parametrize(
    ("scale", "unit", "up"), [(1.0, "m", "y"), (0.01, "m", "y"), (1.0, "cm", "z"), (3.0, "m", "z")]
)
def test_a_rig_from_a_file(
    write_glb: Callable, hand_glb: Callable, tmp_path: Path, scale: float, unit: str, up: str
) -> None:
    """Its file's units and axes, whatever they are; a scale above all joints is the SkelRoot's."""
    glb = armature(scale, False)(hand_glb())
    rig = load_rig(write_glb(glb, tmp_path / "a.glb"), unit=unit, up=up)
    poses = moving(rig)
    path = tmp_path / "out.usdc"
    write_motion(path, rig, poses, rate=RATE, start_frame=START)
    check(path, rig, poses)
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == up.upper()
    assert UsdGeom.GetStageMetersPerUnit(stage) == pytest.approx(0.01 if unit == "cm" else 1.0)
    np.testing.assert_allclose(load_rig(path).source.frames, rig.source.frames, atol=1e-6 * max(scale, 1.0))
    same_poses(load_motion(path, rig).poses, poses)


def test_scales_that_usd_rounds(write_glb: Callable, hand_glb: Callable, tmp_path: Path) -> None:
    """A third is no 16 bit float: joints and skin are in their places yet."""
    rig = load_rig(write_glb(armature(1.0, True)(hand_glb()), tmp_path / "a.glb"))
    poses = moving(rig)
    path = tmp_path / "out.usda"
    assert write_motion(path, rig, poses, rate=RATE, start_frame=START).warnings == ()
    check(path, rig, poses)


def test_names_that_usd_cannot_hold(write_glb: Callable, hand_glb: Callable, tmp_path: Path) -> None:
    """Dots, blanks, letters beyond ASCII; two that become one identifier."""
    from pxr import Sdf, Usd, UsdSkel

    glb = hand_glb(names=lambda name: name.replace(".", " ."))
    glb.names[3:5] = ["ring é", "ring è"]
    rig = load_rig(write_glb(glb, tmp_path / "a.glb"))
    write_motion(tmp_path / "a.usda", rig, moving(rig), rate=RATE)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    skeleton = next(UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton))
    tokens = list(skeleton.GetJointsAttr().Get())
    assert len(set(tokens)) == len(tokens)
    assert all(Sdf.Path.IsValidPathString(token)[0] for token in tokens)
    assert UsdSkel.Topology(tokens).Validate()[0]
    assert load_rig(tmp_path / "a.usda").source.names == rig.source.names


def test_rotations_take_the_short_way(hands: dict[str, Rig], tmp_path: Path) -> None:
    from pxr import Usd, UsdSkel

    rig = hands["left"]
    turns = np.zeros((40, len(rig.skeleton), 4))
    turns[..., 3] = 1.0
    turns[:, 2] = Rotation.from_rotvec(np.linspace(0, 4 * np.pi, 40)[:, None] * [0, 0.6, 0.8]).as_quat(canonical=True)
    write_motion(tmp_path / "a.usdc", rig, poses_from_rotations(rig.skeleton, turns), rate=RATE)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    animation = next(UsdSkel.Animation(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation))
    quaternions = np.array([animation.GetRotationsAttr().Get(time) for time in range(40)])
    assert ((quaternions[1:] * quaternions[:-1]).sum(axis=-1) > 0.9).all()


def test_nothing_is_left_of_a_failure(hands: dict[str, Rig], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.motion.out.usd.joint_weights", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_motion(tmp_path / "a.usdc", hands["left"], moving(hands["left"]), rate=RATE)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError):
        write_motion(tmp_path / "file" / "a.usdc", hands["left"], moving(hands["left"]), rate=RATE)


def test_missing_extra_is_named(hands: dict[str, Rig], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match=r"warpjld\[usd\]"):
        write_motion(tmp_path / "a.usdc", hands["left"], moving(hands["left"]), rate=RATE)
    assert list(tmp_path.iterdir()) == []
