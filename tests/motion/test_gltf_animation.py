"""glTF animations: of generated files with known rotations, and added to copies of real rigs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.skeletons import body, hand, rig
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.gltf.document import open_document
from warpjld.motion import load_motion
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, Poses, Skeleton, default_limits, poses_from_angles
from warpjld.skeleton.recognise.tree import SourceTree

FLOAT32 = 2e-6
"""glTF stores float32; transforms of a few joints in a row."""


class File:
    """A glTF file under construction."""

    def __init__(self, gltf: pygltflib.GLTF2 | None = None) -> None:
        self.gltf = gltf or pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0"), buffers=[pygltflib.Buffer()])
        self.blob = bytearray(self.gltf.binary_blob() or b"") if gltf else bytearray()
        self.gltf.animations = [pygltflib.Animation()]

    def accessor(self, values: np.ndarray) -> int:
        values = np.asarray(values, dtype="<f4")
        self.blob += b"\0" * (-len(self.blob) % 4)
        view = pygltflib.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=values.nbytes)
        self.blob += values.tobytes()
        self.gltf.bufferViews.append(view)
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        record = pygltflib.Accessor(
            bufferView=len(self.gltf.bufferViews) - 1, componentType=5126, count=len(values), type=kind
        )
        if values.ndim == 1:
            record.min, record.max = [float(values.min())], [float(values.max())]
        self.gltf.accessors.append(record)
        return len(self.gltf.accessors) - 1

    def animate(self, node: int, path: str, times: np.ndarray, values: np.ndarray, mode: str = "LINEAR") -> None:
        animation = self.gltf.animations[0]
        sampler = pygltflib.AnimationSampler(
            input=self.accessor(np.asarray(times)), output=self.accessor(values), interpolation=mode
        )
        animation.samplers.append(sampler)
        target = pygltflib.AnimationChannelTarget(node=node, path=path)
        animation.channels.append(pygltflib.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))

    def save(self, path: Path) -> Path:
        self.gltf.buffers[0].byteLength = len(self.blob)
        self.gltf.buffers[0].uri = None
        self.gltf.set_binary_blob(bytes(self.blob))
        self.gltf.save_binary(str(path))
        return path


def chain() -> tuple[File, Rig]:
    """Root, middle and end along x, under a node that doubles and lifts all; the rig was loaded in those places."""
    file = File()
    file.gltf.nodes = [
        pygltflib.Node(name="Armature", children=[1], scale=[2, 2, 2], translation=[0, 1, 0]),
        pygltflib.Node(
            name="Root", children=[2], rotation=Rotation.from_euler("z", 90, degrees=True).as_quat().tolist()
        ),
        pygltflib.Node(name="Middle", children=[3], translation=[0, 0.5, 0]),
        pygltflib.Node(name="End", translation=[0, 0.25, 0]),
    ]
    names = ("root", "middle", "end", "added")
    rest = np.array([[0.0, 1, 0], [-1, 1, 0], [-1.5, 1, 0], [-1.6, 1, 0]])
    skeleton = Skeleton(
        names, np.arange(-1, 3, dtype=np.int32), rest, np.tile([0, 0, 1.0], (4, 1)), default_limits(names)
    )
    frames = np.tile(np.eye(4), (4, 1, 1))
    frames[:, :3, :3] = 2 * Rotation.from_euler("z", 90, degrees=True).as_matrix()
    frames[:, :3, 3] = rest
    return file, rig(
        skeleton,
        source=SourceTree(("Root", "Middle", "End"), np.arange(-1, 2), frames[:3]),
        sources=(0, 1, 2, -1),
    )


def turn(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_quat()


def test_linear_rotations_are_slerped_and_added_joints_follow(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(2, "rotation", [0, 1], np.array([turn("z", 0), turn("z", -90)]))
    moved = load_motion(file.save(tmp_path / "a.glb"), driven, rate=10)
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (11, 10)
    degrees = Rotation.from_quat(poses.rotations[:, 1]).as_rotvec(degrees=True)
    np.testing.assert_allclose(degrees, np.linspace(0, -90, 11)[:, None] * [0, 0, 1], atol=1e-4)
    np.testing.assert_allclose(poses.positions[-1], [[0, 1, 0], [-1, 1, 0], [-1, 1.5, 0], [-1, 1.6, 0]], atol=FLOAT32)
    np.testing.assert_allclose(poses.flexion[:, 1], np.radians(np.linspace(0, -90, 11)), atol=FLOAT32)
    np.testing.assert_allclose(poses.rotations[:, 3], poses.rotations[:, 2], atol=1e-12)


def test_steps_and_cubics_of_translations(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(1, "translation", [0, 1, 2], np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0]]), "STEP")
    cubic = np.zeros((6, 3))
    cubic[[1, 4]] = [[0, 0.5, 0], [0, 1.5, 0]]  # values; tangents zero: 3u² - 2u³
    file.animate(2, "translation", [0, 2], cubic, "CUBICSPLINE")
    poses = load_motion(file.save(tmp_path / "a.glb"), driven, rate=2).poses
    np.testing.assert_allclose(poses.positions[:, 0, 0], [0, 0, 2, 2, 6], atol=FLOAT32)
    u = np.linspace(0, 1, 5)
    stretched = np.linalg.norm(poses.positions[:, 1] - poses.positions[:, 0], axis=1)
    np.testing.assert_allclose(stretched, 2 * (0.5 + 3 * u**2 - 2 * u**3), atol=FLOAT32)


def test_cubic_rotations_are_unit_and_hit_their_keys(tmp_path: Path) -> None:
    file, driven = chain()
    keys = np.zeros((6, 4))
    keys[[1, 4]] = [turn("x", 0), turn("x", 80)]
    file.animate(3, "rotation", [0, 1], keys, "CUBICSPLINE")
    poses = load_motion(file.save(tmp_path / "a.glb"), driven, rate=4).poses
    np.testing.assert_allclose(np.linalg.norm(poses.rotations, axis=-1), 1, atol=1e-12)
    angles = Rotation.from_quat(poses.rotations[:, 2]).magnitude()
    np.testing.assert_allclose(np.degrees(angles[[0, 2, 4]]), [0, 40, 80], atol=1e-4)


def test_scale_moves_joints_and_leaves_rotations(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(1, "scale", [0, 1], np.array([[1, 1, 1], [1, 3, 1]]))
    poses = load_motion(file.save(tmp_path / "a.glb"), driven, rate=1).poses
    np.testing.assert_allclose(poses.positions[1, 1], [-3, 1, 0], atol=FLOAT32)
    np.testing.assert_allclose(poses.rotations[1], np.tile([0, 0, 0, 1], (4, 1)), atol=1e-6)


def test_of_keys_at_one_time_the_last_counts(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(2, "rotation", [0, 1, 1, 2], np.array([turn("z", d) for d in (0, 40, 10, 10)]))
    poses = load_motion(file.save(tmp_path / "a.glb"), driven, rate=2).poses
    degrees = Rotation.from_quat(poses.rotations[:, 1]).as_rotvec(degrees=True)[:, 2]
    np.testing.assert_allclose(degrees, [0, 5, 10, 10, 10], atol=1e-4)


def test_rate_is_that_of_the_keys(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(2, "rotation", np.arange(5) / 24, np.array([turn("z", d) for d in range(0, 50, 10)]))
    moved = load_motion(file.save(tmp_path / "a.glb"), driven)
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (5, 24)


def bent(skeleton: Skeleton, frames: int = 5) -> Poses:
    angles = np.zeros((frames, len(skeleton), 4))
    for j, name in enumerate(skeleton.names):
        if "knuckle" in name or name.endswith("base"):
            angles[:, j, CHANNELS.index("flexion")] = np.linspace(0, 0.6, frames)
    root = np.linspace(0, 0.1, frames)[:, None] * [1.0, 0.5, 0.0]
    return poses_from_angles(skeleton, angles, root_position=root)


def animated_copy(source: Path, driven: Rig, poses: Poses, target: Path) -> Path:
    """The file with its joints animated so that the given poses result."""
    file = File(pygltflib.GLTF2().load(str(source)))
    nodes = file.gltf.nodes
    above = {child: n for n, node in enumerate(nodes) for child in node.children or ()}
    number = {node.name: n for n, node in enumerate(nodes)}
    assert driven.source is not None
    rest = driven.placing @ driven.source.frames[list(driven.sources)]
    shown, worlds = open_document(source).worlds, {}
    for j, name in enumerate(driven.source_joints):
        if name:
            world = np.tile(np.eye(4), (len(poses), 1, 1))
            turned = Rotation.from_quat(poses.rotations[:, j])
            world[:, :3, :3] = turned.as_matrix() @ rest[j, :3, :3]
            world[:, :3, 3] = poses.positions[:, j] + turned.apply(rest[j, :3, 3] - driven.skeleton.rest[j])
            worlds[number[name]] = world
    for n, world in worlds.items():
        local = np.linalg.inv(worlds.get(above[n], shown[above[n]])) @ world
        times = np.arange(len(poses)) / 25
        file.animate(n, "translation", times, local[:, :3, 3])
        file.animate(n, "rotation", times, Rotation.from_matrix(local[:, :3, :3]).as_quat())
    return file.save(target)


@pytest.mark.parametrize("name", ["hand_webxr_generic/left.glb", "hand_webxr_generic/right.glb", "hand_anny/left.glb"])
def test_real_rigs_play_animations_of_their_own(data: Path, tmp_path: Path, name: str) -> None:
    driven = load_rig(data / name)
    wanted = bent(driven.skeleton)
    copy = animated_copy(data / name, driven, wanted, tmp_path / "copy.glb")
    moved = load_motion(copy, driven)
    got, rate = moved.poses, moved.rate
    assert rate == 25
    np.testing.assert_allclose(got.positions, wanted.positions, atol=FLOAT32)
    np.testing.assert_allclose(got.rotations, wanted.rotations, atol=5e-6)
    np.testing.assert_allclose(got.flexion, wanted.flexion, atol=2e-5)


def test_another_skeleton_is_retargeted(data: Path, tmp_path: Path) -> None:
    source = load_rig(data / "hand_webxr_generic" / "left.glb")
    copy = animated_copy(data / "hand_webxr_generic" / "left.glb", source, bent(source.skeleton), tmp_path / "copy.glb")
    driven = rig(hand("left"))
    moved = load_motion(copy, driven)
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (5, 25)
    knuckle = driven.skeleton.index("index.knuckle3")
    assert np.degrees(poses.flexion[-1, knuckle] - poses.flexion[0, knuckle]) == pytest.approx(
        np.degrees(0.6), abs=8
    ), "other flexion axes, the same curl"


def test_files_without_animation_are_refused(tmp_path: Path) -> None:
    file, driven = chain()
    file.accessor(np.zeros(1))
    file.gltf.animations = []
    with pytest.raises(InputError, match="no animation"):
        load_motion(file.save(tmp_path / "a.glb"), driven)


def test_broken_samplers_are_named(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(2, "rotation", [0, 1, 2], np.array([turn("z", 0)] * 2))
    with pytest.raises(InputError, match=r"animation of 'Middle', rotation: want \(3, 4\) values, got \(2, 4\)"):
        load_motion(file.save(tmp_path / "a.glb"), driven)
    file, driven = chain()
    file.animate(2, "rotation", [0, 1, 0.5], np.array([turn("z", 0)] * 3))
    with pytest.raises(InputError, match="key times must increase"):
        load_motion(file.save(tmp_path / "b.glb"), driven)


def test_impossible_values_are_refused(tmp_path: Path) -> None:
    file, driven = chain()
    file.animate(2, "rotation", [0, 1], np.zeros((2, 4)))
    with pytest.raises(InputError, match="its quaternion is zero"):
        load_motion(file.save(tmp_path / "a.glb"), driven)
    file, driven = chain()
    file.animate(2, "translation", [0, 1], np.zeros((2, 3)))
    file.gltf.accessors[0].componentType = None
    with pytest.raises(InputError, match=r"a\.glb: not as glTF 2.0 wants it|a\.glb: accessor"):
        load_motion(file.save(tmp_path / "a.glb"), driven)
    file, driven = chain()
    file.animate(2, "translation", [0, 1e9], np.zeros((2, 3)))
    with pytest.raises(InputError, match="the limit is 2,000,000"):
        load_motion(file.save(tmp_path / "a.glb"), driven, rate=30)


def test_unrelated_skeleton_is_refused(tmp_path: Path) -> None:
    file, _ = chain()
    file.animate(2, "rotation", [0, 1], np.array([turn("z", 0)] * 2))
    with pytest.raises(InputError, match="was recognised"):
        load_motion(file.save(tmp_path / "a.glb"), rig(body()))
