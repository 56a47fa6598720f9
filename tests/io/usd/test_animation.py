"""UsdSkel animations: against the same keys in a glTF file, and against OpenUSD's own skinning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gl
import pytest
from scipy.spatial.transform import Rotation

from tests.io.usd.stages import Keys, Stage, gf, instanced, transform
from tests.io.usd.test_skin import bar, plain_name, stage_of
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.usd.skin import read_usd_rig
from warpjld.motion import load_motion
from warpjld.motion.animations import animation_names
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.usd_animation import read_usd_animation

pytest.importorskip("pxr")

POSITION, ROTATION = 1e-6, 1e-5


@pytest.fixture(scope="module")
def hand(hand_glb: Callable[..., Any]) -> Stage:
    """The built-in left hand."""
    return stage_of(hand_glb(names=plain_name))


def keys_of(stage: Stage, times: list[float], seed: int = 0, **more: Any) -> Keys:
    """Every joint turned and moved a little, differently at every key; the joints from the wrist on bend."""
    local = stage.local_rest()
    random = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(random.normal(0, 0.3, (len(times) * len(local), 3)))
    base = np.tile(local[:, :3, :3], (len(times), 1, 1))
    moves = local[:, :3, 3] + random.normal(0, 0.001, (len(times), len(local), 3))
    rotations = (Rotation.from_matrix(base) * turns).as_quat().reshape(len(times), -1, 4)
    return Keys(times, moves, rotations, **more)


def with_animation(glb: Path, keys: Keys, seconds: np.ndarray) -> Path:
    """Add the keys to a glTF file whose first nodes are the joints."""
    document = gl.GLTF2().load(str(glb))
    blob = bytearray(document.binary_blob())

    def accessor(values: np.ndarray, kind: str) -> int:
        values = np.ascontiguousarray(values, dtype="<f4")
        blob.extend(b"\0" * (-len(blob) % 4))
        document.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=values.nbytes))
        blob.extend(values.tobytes())
        document.accessors.append(
            gl.Accessor(bufferView=len(document.bufferViews) - 1, componentType=gl.FLOAT, count=len(values), type=kind)
        )
        return len(document.accessors) - 1

    times = accessor(seconds, "SCALAR")
    animation = gl.Animation(samplers=[], channels=[])
    for j in range(keys.translations.shape[1]):
        for path, values, kind in (
            ("translation", keys.translations[:, j], "VEC3"),
            ("rotation", keys.rotations[:, j], "VEC4"),
        ):
            animation.samplers.append(gl.AnimationSampler(input=times, output=accessor(values, kind)))
            target = gl.AnimationChannelTarget(node=j, path=path)
            animation.channels.append(gl.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))
    document.animations = [animation]
    document.buffers[0].byteLength = len(blob)
    document.set_binary_blob(bytes(blob))
    document.save_binary(str(glb))
    return glb


@pytest.mark.parametrize(("rate", "start"), [(24.0, 1.0), (30.0, 101.0), (30.0, -7.0)])
@pytest.mark.parametrize("apart", [1, 5])
def test_the_same_motion_as_gltf(
    write_glb: Callable, hand_glb: Callable, hand: Stage, tmp_path: Path, rate: float, start: float, apart: int
) -> None:
    """Keys on every frame or every fifth, at 24 and 30 a second, from some frame on; the last frame included."""
    times = [start + apart * n for n in range(5)]
    keys = keys_of(hand, times)
    usd = replace(hand, keys=[keys], rate=rate).write(tmp_path / "a.usdc")
    glb = with_animation(
        write_glb(hand_glb(names=plain_name), tmp_path / "a.glb"), keys, (np.array(times) - start) / rate
    )
    theirs = load_motion(glb, load_rig(glb), rate=rate).poses
    moved = load_motion(usd, load_rig(usd))
    ours, own_rate = moved.poses, moved.rate
    assert own_rate == rate
    assert len(ours) == 4 * apart + 1 == len(theirs)
    np.testing.assert_allclose(ours.positions, theirs.positions, atol=POSITION)
    turned = Rotation.from_quat(ours.rotations.reshape(-1, 4)).inv() * Rotation.from_quat(
        theirs.rotations.reshape(-1, 4)
    )
    assert turned.magnitude().max() < ROTATION
    assert np.abs(np.diff(ours.rotations, axis=0)).max() > 0.05


def skinned_by_openusd(path: Path, codes: np.ndarray) -> np.ndarray:
    """World positions of the mesh at time codes, deformed by UsdSkel itself, shape (F, W, 3)."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage = Usd.Stage.Open(str(path))
    root = UsdSkel.Root(next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)))
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    query, (mesh,) = cache.GetSkelQuery(binding.GetSkeleton()), binding.GetSkinningTargets()
    out = []
    for code in codes.tolist():
        points = UsdGeom.Mesh(mesh.GetPrim()).GetPointsAttr().Get()
        assert mesh.ComputeSkinnedPoints(query.ComputeSkinningTransforms(code), points, code)
        world = np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(query.GetPrim()))
        out.append(np.array(points, dtype=np.float64) @ world[:3, :3] + world[3, :3])
    return np.array(out)


def skinned(path: Path, animation: JointAnimation) -> np.ndarray:
    rig = read_usd_rig(path)
    moved = animation.worlds @ np.linalg.inv(rig.tree.frames)
    points = np.column_stack([rig.vertices, np.ones(len(rig.vertices))])
    return np.einsum("vk,fvkab,vb->fva", rig.weights, moved[:, rig.joints], points)[..., :3]


@pytest.mark.parametrize("world_bind", [False, True])
def test_flesh_is_where_openusd_has_it(hand: Stage, tmp_path: Path, world_bind: bool) -> None:
    """A moving SkelRoot, scales, an own order of joints in animation and mesh, joints left out, uneven keys."""
    from pxr import Usd, UsdGeom

    place, bind = transform((0.3, 0.1, -0.2), (0.2, 0.5, -0.3)), transform((0.1, 0, 0), (0, 0.4, 0), 2.0)
    times = [3.0, 4.5, 10.0]
    order = np.random.default_rng(8).permutation(len(hand.names))
    few = order[:14].tolist()
    keys = keys_of(hand, times)
    scales = np.random.default_rng(9).uniform(0.8, 1.25, (3, 14, 3))
    keys = Keys(times, keys.translations[:, few], keys.rotations[:, few], scales, joints=few)
    stage = replace(
        hand, keys=[keys], rate=25.0, span=(2.0, 12.0), place=place, mesh_joints=order.tolist(),
        vertices=hand.vertices @ np.linalg.inv(bind)[:3, :3].T + np.linalg.inv(bind)[:3, 3], geom_bind=bind,
    )  # fmt: skip
    if world_bind:
        stage = replace(stage, frames=place @ hand.frames, rest=hand.frames, geom_bind=place @ bind)
    path = stage.write(tmp_path / "a.usda")
    opened = Usd.Stage.Open(str(path))
    (operation,) = UsdGeom.Xformable(opened.GetPrimAtPath("/World/Rig")).GetOrderedXformOps()
    operation.Set(gf(transform((0.1, 0.4, 0)) @ place), 12.0)
    operation.Set(gf(place), 2.0)
    opened.Save()
    del opened
    animation = read_usd_animation(path)
    assert (len(animation), animation.rate) == (11, 25.0)
    np.testing.assert_allclose(
        skinned(path, animation), skinned_by_openusd(path, np.arange(2.0, 12.5)), atol=2 * POSITION
    )
    fine = read_usd_animation(path, rate=50.0)
    assert len(fine) == 21
    np.testing.assert_allclose(fine.worlds[::2], animation.worlds, atol=1e-12)
    rig = load_rig(path)
    assert animation.tree.names == rig.source.names
    np.testing.assert_array_equal(animation.tree.frames, rig.source.frames)


def test_units_and_axes(hand: Stage, tmp_path: Path) -> None:
    """A Z-up stage in centimetres moves as the plain one does."""
    to_stage = transform(scale=100.0) @ transform(turn=(np.pi / 2, 0, 0))
    frames = to_stage @ hand.frames
    frames[:, :3, :3] /= 100.0
    other = replace(hand, frames=frames, vertices=hand.vertices @ to_stage[:3, :3].T, metres=0.01, up="Z")
    keys = [keys_of(hand, [1.0, 2, 3]), keys_of(other, [1.0, 2, 3])]
    keys[1].translations = other.local_rest()[:, :3, 3] + 100.0 * (keys[0].translations - hand.local_rest()[:, :3, 3])
    keys[1].translations[:, 0] = (keys[0].translations[:, 0]) @ to_stage[:3, :3].T
    a = replace(hand, keys=keys[:1]).write(tmp_path / "a.usda")
    b = replace(other, keys=keys[1:]).write(tmp_path / "b.usda")
    rigs = load_rig(a), load_rig(b)
    poses = [load_motion(path, rig).poses for path, rig in zip((a, b), rigs, strict=True)]
    np.testing.assert_allclose(poses[1].positions, poses[0].positions, atol=POSITION)
    clips = [read_usd_animation(path).clip() for path in (a, b)]
    np.testing.assert_allclose(clips[1].positions, 100 * clips[0].positions, atol=1e-3)
    np.testing.assert_allclose(np.abs(np.sum(clips[1].rotations * clips[0].rotations, axis=-1)), 1.0, atol=1e-9)


def test_stages_with_an_animation_only(hand: Stage, tmp_path: Path) -> None:
    keys = [keys_of(hand, [0.0, 1, 2])]
    whole = replace(hand, keys=keys).write(tmp_path / "a.usda")
    bare = replace(hand, keys=keys, with_mesh=False).write(tmp_path / "b.usda")
    rig = load_rig(whole)
    np.testing.assert_array_equal(load_motion(bare, rig).poses.rotations, load_motion(whole, rig).poses.rotations)


def test_animations_are_chosen_by_name(tmp_path: Path) -> None:
    many = [
        keys_of(bar(), [0.0, 1], seed, name=name, bound=name == "Walk") for seed, name in enumerate(("Idle", "Walk"))
    ]
    path = bar(keys=many).write(tmp_path / "a.usda")
    assert animation_names(path) == ("Walk", "Idle")
    single = [bar(keys=[replace(keys, bound=True)]).write(tmp_path / f"{keys.name}.usda") for keys in many]
    idle, walk = (read_usd_animation(one) for one in single)
    first = read_usd_animation(path)
    np.testing.assert_array_equal(first.worlds, walk.worlds)
    assert first.title == "Walk"
    assert "the first of 2: Walk, Idle" in first.notes[0]
    chosen = read_usd_animation(path, name="idle")
    np.testing.assert_array_equal(chosen.worlds, idle.worlds)
    assert any("bound to no skeleton" in note for note in chosen.notes)
    with pytest.raises(InputError, match="no animation 'Wlak'"):
        read_usd_animation(path, name="Wlak")


def test_each_instance_moves(tmp_path: Path) -> None:
    places = {"A": transform((5.0, 0, 0)), "B": transform((-5.0, 0, 0), (0, 1.0, 0))}
    keys = [keys_of(bar(), [0.0, 1])]
    path = instanced(bar(keys=keys), tmp_path / "a.usda", places)
    assert animation_names(path) == ("Animation",)
    plain = read_usd_animation(bar(keys=keys).write(tmp_path / "b.usda"))
    moved = read_usd_animation(path)
    for i, place in enumerate(places.values()):
        np.testing.assert_allclose(moved.worlds[:, 2 * i : 2 * i + 2], place @ plain.worlds, atol=1e-6)


def test_scales_of_zero_and_below(tmp_path: Path) -> None:
    keys = keys_of(bar(), [0.0, 1, 2])
    keys.scales = np.ones((3, 2, 3))
    keys.scales[1, 1], keys.scales[2, 0] = 0.0, (-1, 1, 1)
    animation = read_usd_animation(bar(keys=[keys]).write(tmp_path / "a.usda"))
    assert (np.linalg.det(animation.worlds[..., :3, :3]) > 0.0).all()
    root = animation.worlds[2, 0]
    turn = Rotation.from_quat(keys.rotations[2, 0]).as_matrix()
    np.testing.assert_allclose(root[:3, :3], turn, atol=1e-6)
    np.testing.assert_allclose(
        animation.worlds[2, 1, :3, 3], root[:3, 3] + turn @ ([-1, 1, 1] * keys.translations[2, 1]), atol=1e-6
    )
    assert any("'root': its scale turns negative at frame 2" in warning for warning in animation.warnings)


def test_what_is_not_followed_is_told(tmp_path: Path) -> None:
    keys = [keys_of(bar(), [0.0, 10.0])]
    loaded = bar(keys=keys, span=(2.0, 5.0)).write(tmp_path / "a.usda")
    animation = read_usd_animation(loaded)
    assert len(animation) == 4
    assert "keys from time code 0 to 10, of which the stage plays 2 to 5" in animation.warnings[0]


def test_ticks_are_not_frames(tmp_path: Path) -> None:
    animation = read_usd_animation(bar(keys=[keys_of(bar(), [0.0, 6000.0])], rate=6000.0).write(tmp_path / "a.usda"))
    assert (len(animation), animation.rate) == (25, 24.0)


def vertex_cache(path: Path) -> Path:
    from warpjld.geometry.surface import weld_surface
    from warpjld.io.caches import open_cache

    surface = weld_surface(np.eye(3), [[0, 1, 2]])
    with open_cache(path, surface, frames=3, rate=24) as cache:
        cache.write(np.arange(27, dtype=np.float32).reshape(3, 3, 3))
    return path


def test_no_animation_is_told_why(hand: Stage, tmp_path: Path) -> None:
    rig = load_rig(hand.write(tmp_path / "a.usda"))
    for path, message in (
        (tmp_path / "a.usda", "no animation in this file: its skeleton is not animated"),
        (vertex_cache(tmp_path / "b.usdc"), "is a vertex cache"),
        (bar(joints=None, keys=[]).write(tmp_path / "c.usda"), "no animation in this file"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            load_motion(path, rig)
        assert caught.value.path == path


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (lambda k: k.rotations.__setitem__((1, 1), 0.0), "joint 'root/end' has no rotation at frame 1"),
        (lambda k: k.translations.__setitem__((1, 1), np.nan), "joint 'end' is not finite at frame 1"),
        (lambda k: setattr(k, "translations", np.zeros((2, 1, 3))), "want 2 translations, one for each of its joints"),
        (lambda k: k.times.__setitem__(1, 1e12), "the limit is 2,000,000"),
    ],
)
def test_broken_samples_are_named(tmp_path: Path, broken: Callable, message: str) -> None:
    keys = keys_of(bar(), [0.0, 1.0])
    broken(keys)
    path = bar(keys=[keys]).write(tmp_path / "a.usda")
    with pytest.raises(InputError, match=message):
        load_motion(path, load_rig(path))
