"""FBX rigs and animations, against the same rig written as GLB, and against the arrays both were written from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.io.conftest import Glb
from tests.io.fbx_text import Fbx, Mesh
from warpjld.io.fbx.rig import read_fbx_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.io.source import SourceRig
from warpjld.motion.fbx_animation import read_fbx_animation

pytest.importorskip("ufbx")

PLACE, TURN = 1e-6, 1e-5  # what the reading is held to: metres, and entries of rotation matrices
SINGLE = 3e-6
"""Keys are single floats: angles of up to 180° in degrees, down a chain of joints."""


@pytest.fixture(scope="module")
def hand(hand_glb: Callable[..., Glb]) -> Glb:
    """The built-in hand with frames whose axes lie anyhow."""
    return hand_glb("left")


def as_fbx(glb: Glb, **more: object) -> Fbx:
    mesh = Mesh("skin", glb.vertices, glb.faces.tolist(), glb.joints, glb.weights, node=_anywhere())
    content: dict[str, object] = {"names": glb.names, "parents": glb.parents, "frames": glb.frames, "meshes": [mesh]}
    return Fbx(**(content | more))  # type: ignore[arg-type]


def _anywhere() -> np.ndarray:
    node = np.eye(4)
    node[:3, :3] = Rotation.from_euler("xyz", [20.0, -50.0, 110.0], degrees=True).as_matrix() * 1.7
    node[:3, 3] = 0.3, -0.2, 0.5
    return node


def moved(glb: Glb, frames: int = 6) -> np.ndarray:
    """World transforms of an animation: every joint turns about its own axis, the root also travels."""
    local = np.array(
        [np.linalg.inv(glb.frames[p]) @ f if p >= 0 else f for f, p in zip(glb.frames, glb.parents, strict=True)]
    )
    worlds = np.empty((frames, *local.shape))
    random = np.random.default_rng(5)
    axes = random.normal(size=(len(local), 3))
    axes *= random.uniform(0.2, 0.7, (len(local), 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    for f in range(frames):
        for j, parent in enumerate(glb.parents):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(axes[j] * f / (frames - 1)).as_matrix()
            own = local[j] @ turn
            if parent < 0:
                own[:3, 3] += 0.05 * f
            worlds[f, j] = own if parent < 0 else worlds[f, parent] @ own
    return worlds


def dense(rig: SourceRig) -> np.ndarray:
    out = np.zeros((len(rig.vertices), len(rig.tree)))
    assert rig.joints is not None
    assert rig.weights is not None
    np.add.at(out, (np.arange(len(out))[:, None], rig.joints), rig.weights)
    return out


def from_lowest(faces: np.ndarray) -> np.ndarray:
    """Triangles that start at their lowest vertex."""
    return np.take_along_axis(faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)


VARIETY = [
    # unit [cm], up, rotation order, pre- and post-rotation
    (1.0, "y", 0, False),
    (100.0, "y", 0, True),
    (2.54, "z", 1, True),
    (1.0, "z", 2, True),
    (100.0, "x", 3, True),
    (0.1, "-z", 4, True),
    (1.0, "y, facing x", 5, True),
    (30.48, "left-handed", 5, False),
]


@pytest.mark.parametrize(("unit", "up", "order", "turned"), VARIETY)
def test_the_same_rig_and_animation_as_glb(
    hand: Glb, write_glb: Callable[[Glb, Path], Path], tmp_path: Path, unit: float, up: str, order: int, turned: bool
) -> None:
    count = len(hand.names)
    random = np.random.default_rng(order)
    pre = random.uniform(-80, 80, (count, 3)) if turned else None
    post = random.uniform(-80, 80, (count, 3)) if turned else None
    worlds = moved(hand)
    orders = [(order + j) % 6 for j in range(count)]
    fbx = as_fbx(hand, unit=unit, up=up, orders=orders, pre=pre, post=post, stacks={"wave": worlds})
    path = fbx.write(tmp_path / "hand.fbx")
    read, expected = read_fbx_rig(path), read_gltf_rig(write_glb(hand, tmp_path / "hand.glb"))
    assert read.tree.names == expected.tree.names
    np.testing.assert_array_equal(read.tree.parents, expected.tree.parents)
    np.testing.assert_allclose(read.tree.positions, expected.tree.positions, atol=PLACE)
    mirrored = up == "left-handed"  # then the axes of joints are another's convention
    if not mirrored:
        np.testing.assert_allclose(read.tree.frames[:, :3, :3], expected.tree.frames[:, :3, :3], atol=TURN)
    # glTF's writer numbers vertices as its faces use them; the FBX keeps the file's order
    used = np.unique(hand.faces)
    np.testing.assert_allclose(read.vertices[used], expected.vertices, atol=PLACE)
    np.testing.assert_allclose(dense(read)[used], dense(expected), atol=1e-6)
    np.testing.assert_array_equal(from_lowest(read.faces), from_lowest(hand.faces))
    animation = read_fbx_animation(path)
    assert animation.title == "wave"
    assert animation.rate == 30.0
    assert animation.tree.names == read.tree.names
    np.testing.assert_allclose(animation.tree.frames, read.tree.frames, atol=1e-12)
    flesh = animation.worlds @ np.linalg.inv(animation.tree.frames)
    wanted = worlds @ np.linalg.inv(hand.frames)
    np.testing.assert_allclose(animation.worlds[..., :3, 3], worlds[..., :3, 3], atol=SINGLE)
    np.testing.assert_allclose(flesh[..., :3, :3], wanted[..., :3, :3], atol=TURN)
    if not mirrored:
        np.testing.assert_allclose(animation.worlds[..., :3, :3], worlds[..., :3, :3], atol=TURN)
