"""Skinned GLB written, evaluated by code of the test's own, and read back as a rig's own animation."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.out.gltf_reader import chunks, evaluate, skinned
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.skeleton_file import write_skeleton_file
from warpjld.motion import load_motion
from warpjld.motion.out import write_motion
from warpjld.motion.out.source_motion import source_motion
from warpjld.rig import Rig, Skin
from warpjld.skeleton import Poses, poses_from_rotations, poses_from_world

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
CLOSE = 1e-6  # float32, of a hand of 0.2 m


def turning(rig: Rig, frames: int, *, grows: bool = False) -> Poses:
    """Every joint turns about an axis of its own while the root goes away; some bones may grow."""
    draw = np.random.default_rng(4)
    ends = draw.normal(0.0, 1.0, (len(rig.skeleton), 3))
    local = np.stack([Rotation.from_rotvec(ends * t).as_quat() for t in np.linspace(0.0, 1.5, frames)])
    root = np.linspace(0.0, 1.0, frames)[:, None] * np.array([0.4, 1.0, -0.3])
    poses = poses_from_rotations(rig.skeleton, local, root_position=root)
    if not grows:
        return poses
    longer = poses.positions + np.linspace(0, 0.01, frames)[:, None, None] * draw.normal(size=(len(rig.skeleton), 3))
    return poses_from_world(rig.skeleton, longer, poses.rotations)


def armature(scale: float) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = scale * Rotation.from_euler("xyz", [-90, 0, 20], degrees=True).as_matrix()
    out[:3, 3] = (0.1, 0.2, -0.3)
    return out


@pytest.mark.parametrize("kind", ["plain", "flat", "matrices", "centimetres", "turned", "mirrored"])
@pytest.mark.parametrize("grows", [pytest.param(False, marks=pytest.mark.slow), True])
def test_joints_stand_where_they_should(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path, kind: str, grows: bool
) -> None:
    glb = hand_glb()
    if kind == "centimetres":  # all of the file
        frames = glb.frames.copy()
        frames[:, :3, 3] *= 100.0
        glb = replace(glb, frames=frames, vertices=100.0 * glb.vertices)
    elif kind == "turned":  # centimetres under an armature that makes metres of them
        frames = glb.frames.copy()
        frames[:, :3, 3] *= 100.0
        glb = replace(glb, frames=frames, vertices=100.0 * glb.vertices, armature=armature(0.01))
    elif kind == "mirrored":
        frames = glb.frames.copy()
        frames[:, :3, 0] *= -1.0
        glb = replace(glb, frames=frames, matrices=True)
    else:
        glb = replace(glb, flat=kind == "flat", matrices=kind == "matrices")
    rig = load_rig(write_glb(glb, tmp_path / "rig.glb"))
    poses = turning(rig, 5, grows=grows)
    written = write_motion(tmp_path / "out.glb", rig, poses, rate=25.0)
    assert not written.warnings
    content, times, worlds = evaluate(tmp_path / "out.glb")
    np.testing.assert_allclose(times, np.arange(5) / 25.0, atol=1e-7)
    assert rig.source is not None
    nodes = [next(n for n, node in enumerate(content["nodes"]) if node["name"] == name) for name in rig.source.names]
    placed = np.einsum("ab,fnb->fna", rig.placing, worlds[:, nodes][..., :, 3])[..., :3]
    own = list(rig.owner)
    np.testing.assert_allclose(placed, source_motion(rig, poses).positions(), atol=CLOSE)
    # by hand: the joint's rest place, carried along by its flesh
    at = (rig.placing @ rig.source.frames)[:, :3, 3]
    for f in range(5):
        turns = Rotation.from_quat(poses.rotations[f, own])
        expected = turns.apply(at - rig.skeleton.rest[own]) + poses.positions[f, own]
        np.testing.assert_allclose(placed[f], expected, atol=CLOSE)
    again = load_rig(tmp_path / "out.glb")
    back = load_motion(tmp_path / "out.glb", again)
    assert len(back.poses) == 5
    np.testing.assert_allclose(back.poses.positions, poses.positions, atol=CLOSE)
    same = np.abs((back.poses.rotations * poses.rotations).sum(-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-10)


def test_only_joints_that_stray_are_translated(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path
) -> None:
    rig = load_rig(write_glb(hand_glb(), tmp_path / "rig.glb"))
    write_motion(tmp_path / "out.glb", rig, turning(rig, 5), rate=25.0)
    channels = chunks(tmp_path / "out.glb")[0]["animations"][0]["channels"]
    moved = [c["target"]["node"] for c in channels if c["target"]["path"] == "translation"]
    assert [chunks(tmp_path / "out.glb")[0]["nodes"][n]["name"] for n in moved] == ["left.wrist"]
    assert len(channels) == len(rig.skeleton) + 1


def test_turns_are_interpolated_the_short_way(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path
) -> None:
    from tests.motion.out.gltf_reader import array

    rig = load_rig(write_glb(hand_glb(), tmp_path / "rig.glb"))
    poses = turning(rig, 40)
    write_motion(tmp_path / "out.glb", rig, poses, rate=25.0)
    content, binary = chunks(tmp_path / "out.glb")
    for channel in content["animations"][0]["channels"]:
        if channel["target"]["path"] == "rotation":
            keys = array(content, binary, content["animations"][0]["samplers"][channel["sampler"]]["output"])
            np.testing.assert_allclose(np.linalg.norm(keys, axis=1), 1.0, atol=1e-6)
            assert ((keys[1:] * keys[:-1]).sum(1) > 0.9).all()


def test_the_rigs_own_file_stays_as_it_is(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path
) -> None:
    """What no library knows of is kept, the file's animations too; the new one comes first."""
    path = write_glb(hand_glb(), tmp_path / "rig.glb")
    content, binary = chunks(path)
    content["asset"]["extras"] = {"made by": "héro"}
    content["nodes"][3]["extensions"] = {"EXT_own": {"a": [1, None]}}
    content["extensionsUsed"] = ["EXT_own"]
    content["materials"] = [{"name": "skin", "pbrMetallicRoughness": {"roughnessFactor": 0.25}}]
    content["meshes"][0]["primitives"][0]["material"] = 0
    content["animations"] = [{"name": "before", "channels": [], "samplers": []}]
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    path.write_bytes(
        head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    rig = load_rig(path)
    write_motion(tmp_path / "out.glb", rig, turning(rig, 3), rate=25.0, name="wave")
    after, bytes_after = chunks(tmp_path / "out.glb")
    assert bytes_after.startswith(binary)
    assert [animation["name"] for animation in after["animations"]] == ["wave", "before"]
    for key in content:
        if key in ("accessors", "bufferViews"):
            assert after[key][: len(content[key])] == content[key]
        elif key not in ("animations", "buffers"):
            assert after[key] == content[key], key


def test_files_beside_a_gltf_are_taken_in(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path
) -> None:
    content, binary = chunks(write_glb(hand_glb(), tmp_path / "rig.glb"))
    (tmp_path / "my data.bin").write_bytes(binary)
    (tmp_path / "skin.png").write_bytes(b"\x89PNG picture")
    content["buffers"][0]["uri"] = "my%20data.bin"
    content["images"] = [{"uri": "skin.png"}, {"uri": "missing.jpg"}]
    (tmp_path / "rig.gltf").write_text(json.dumps(content), "utf-8")
    rig = load_rig(tmp_path / "rig.gltf")
    poses = turning(rig, 3)
    written = write_motion(tmp_path / "else" / "where.glb", rig, poses, rate=25.0)
    assert len(written.warnings) == 1
    assert "picture 'missing.jpg' cannot be read" in written.warnings[0]
    after, stored = chunks(tmp_path / "else" / "where.glb")
    picture = after["images"][0]
    assert picture.keys() == {"bufferView", "mimeType"}
    assert picture["mimeType"] == "image/png"
    view = after["bufferViews"][picture["bufferView"]]
    assert stored[view["byteOffset"] :][: view["byteLength"]] == b"\x89PNG picture"
    back = load_motion(tmp_path / "else" / "where.glb", load_rig(tmp_path / "else" / "where.glb"))
    np.testing.assert_allclose(back.poses.positions, poses.positions, atol=CLOSE)


def test_shear_is_told(write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path) -> None:
    """A joint scaled by different factors shears what turns below it: not to be had in glTF, so places only."""
    glb = hand_glb()
    frames = glb.frames.copy()
    frames[:] = np.eye(4)
    frames[:, :3, 3] = glb.frames[:, :3, 3]
    frames[:, :3, :3] = np.diag([1.0, 2.0, 1.0])  # the wrist's scale: all have it in the world
    rig = load_rig(write_glb(replace(glb, frames=frames), tmp_path / "rig.glb"))
    poses = turning(rig, 3)
    written = write_motion(tmp_path / "out.glb", rig, poses, rate=25.0)
    assert len(written.warnings) == 1
    assert "are below one scaled by different factors" in written.warnings[0]
    content, _, worlds = evaluate(tmp_path / "out.glb")
    assert rig.source is not None
    nodes = [next(n for n, node in enumerate(content["nodes"]) if node["name"] == name) for name in rig.source.names]
    np.testing.assert_allclose(worlds[:, nodes][..., :3, 3], source_motion(rig, poses).positions(), atol=CLOSE)


@pytest.mark.parametrize("painted", [False, True])
def test_a_rig_from_elsewhere_becomes_a_file_of_its_own(hands: dict[str, Rig], tmp_path: Path, painted: bool) -> None:
    rig = hands["left"]
    if painted:
        draw = np.random.default_rng(1)
        joints = np.stack([draw.permutation(len(rig.skeleton))[:6] for _ in rig.surface.vertices]).astype(np.int32)
        weights = draw.dirichlet(np.ones(6), len(joints))
        rig = replace(rig, skin=Skin(joints, weights))
    poses = turning(rig, 4, grows=True)
    written = write_motion(tmp_path / "out.glb", rig, poses, rate=30.0)
    assert any("no painted weights" in note for note in written.notes) != painted
    content, _, worlds = evaluate(tmp_path / "out.glb")
    names = [node["name"] for node in content["nodes"]]
    at = [names.index(name) for name in rig.skeleton.names]
    np.testing.assert_allclose(worlds[:, at][..., :3, 3], poses.positions, atol=CLOSE)
    shown = skinned(tmp_path / "out.glb", content, worlds[3], names.index(rig.name))
    assert np.isfinite(shown).all()
    if painted:  # plain linear blend skinning, by the rotations of the poses
        assert rig.skin is not None
        expected = np.zeros((len(rig.surface.vertices), 3))
        for k in range(6):
            j = rig.skin.joints[:, k]
            offset = rig.surface.vertices - rig.skeleton.rest[j]
            moved = Rotation.from_quat(poses.rotations[3, j]).apply(offset) + poses.positions[3, j]
            kept = np.where(rig.skin.weights >= 2e-3, rig.skin.weights, 0.0)
            expected += (kept / kept.sum(axis=1, keepdims=True))[:, k, None] * moved
        off = np.linalg.norm(shown - expected[rig.surface.weld], axis=1)
        assert np.median(off) < CLOSE
        assert off.max() < 5e-3  # where a weight near the smallest was left out
    again = load_rig(tmp_path / "out.glb", side="left")
    back = load_motion(tmp_path / "out.glb", again)
    own = [rig.skeleton.names.index(name) for name in again.skeleton.names]
    np.testing.assert_allclose(back.poses.positions, poses.positions[:, own], atol=CLOSE)


def test_a_skeleton_file_in_a_rigged_surface_is_not_the_surfaces(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], hands: dict[str, Rig], tmp_path: Path
) -> None:
    path = write_glb(hand_glb(), tmp_path / "rig.glb")
    write_skeleton_file(tmp_path / "rig.json", hands["left"].skeleton)
    rig = load_rig(path, skeleton=tmp_path / "rig.json")
    poses = turning(rig, 3)
    written = write_motion(tmp_path / "out.glb", rig, poses, rate=25.0)
    assert "the rig's joints are not those of rig.glb: written as a file of its own" in written.notes
    content, _, worlds = evaluate(tmp_path / "out.glb")
    names = [node["name"] for node in content["nodes"]]
    at = [names.index(name) for name in rig.skeleton.names]
    np.testing.assert_allclose(worlds[:, at][..., :3, 3], poses.positions, atol=CLOSE)


def test_flesh_follows_the_bone_it_lies_on(hands: dict[str, Rig], tmp_path: Path) -> None:
    """Weights worked out from the geometry: the pad of a bent finger goes with its last bone, the forearm stays."""
    rig = hands["left"]
    local = np.zeros((1, len(rig.skeleton), 4))
    local[..., 3] = 1.0
    local[0, rig.skeleton.index("index.base")] = Rotation.from_rotvec([-1.0, 0, 0]).as_quat()
    poses = poses_from_rotations(rig.skeleton, local)
    write_motion(tmp_path / "out.glb", rig, poses, rate=30.0)
    content, _, worlds = evaluate(tmp_path / "out.glb")
    shown = skinned(tmp_path / "out.glb", content, worlds[0], len(rig.skeleton))
    rest = rig.surface.vertices[rig.surface.weld]
    tip, last = rig.skeleton.index("index.tip"), rig.skeleton.index("index.knuckle3")
    pad = np.linalg.norm(rest - rig.skeleton.rest[tip], axis=1) < 0.008
    expected = Rotation.from_quat(poses.rotations[0, last]).apply(rest[pad] - rig.skeleton.rest[last])
    assert pad.sum() > 5
    assert np.abs(shown[pad] - expected - poses.positions[0, last]).max() < 2e-3
    arm = np.linalg.norm(rest - rig.skeleton.rest[0], axis=1) < 0.03
    assert np.abs(shown[arm] - rest[arm]).max() < 1e-3


def test_a_file_that_is_gone_is_named(
    write_glb: Callable[..., Path], hand_glb: Callable[..., Any], tmp_path: Path
) -> None:
    path = write_glb(hand_glb(), tmp_path / "rig.glb")
    rig = load_rig(path)
    path.unlink()
    with pytest.raises(InputError, match=r"rig\.glb: cannot be read"):
        write_motion(tmp_path / "out.glb", rig, turning(rig, 2), rate=25.0)
    assert list(tmp_path.iterdir()) == []


def test_unknown_suffixes_and_places(hands: dict[str, Rig], tmp_path: Path) -> None:
    poses = turning(hands["left"], 2)
    with pytest.raises(InputError, match=r"unknown kind of motion file '\.fbx'; known: \.bvh"):
        write_motion(tmp_path / "a.fbx", hands["left"], poses, rate=25.0)
    with pytest.raises(InputError, match="rate: want frames a second"):
        write_motion(tmp_path / "a.bvh", hands["left"], poses, rate=0.0)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; want a folder"):
        write_motion(tmp_path / "file" / "a.bvh", hands["left"], poses, rate=25.0)
    (tmp_path / "folder.bvh").mkdir()
    with pytest.raises(InputError, match=r"folder\.bvh: cannot be written: "):
        write_motion(tmp_path / "folder.bvh", hands["left"], poses, rate=25.0)
    assert {path.name for path in tmp_path.iterdir()} == {"file", "folder.bvh"}
