"""BVH of a rig's own joints is an animation of the rig: what was written is read again, exactly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.skeletons import body
from tests.motion.skeletons import rig as rigged
from tests.motion.skinned_files import animal, write
from tests.motion.test_own_animation import FBX, TURNED, gait
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.bvh import read_bvh
from warpjld.motion.clip import Clip
from warpjld.motion.out import write_motion
from warpjld.motion.own_joints import own_poses
from warpjld.motion.own_recording import own_recording, with_own_joints
from warpjld.rig import Rig
from warpjld.skeleton import Poses, poses_from_rotations


def assert_same(got: Poses, want: Poses, close: float = 1e-6) -> None:
    size = float(np.linalg.norm(np.ptp(want.positions[0], axis=0)))  # animals of millimetres may be read as metres
    np.testing.assert_allclose(got.positions, want.positions, atol=close * max(size, 1.0))
    np.testing.assert_allclose(np.abs((got.rotations * want.rotations).sum(-1)), 1.0, atol=1e-9)


def moved(rig: Rig, frames: int = 5) -> Poses:
    draw = np.random.default_rng(3)
    ends = draw.normal(0.0, 0.6, (len(rig.skeleton), 3))
    ends[[source < 0 for source in rig.sources or [0] * len(ends)]] = 0.0  # added fingertips are in no file
    local = np.stack([Rotation.from_rotvec(ends * t).as_quat() for t in np.linspace(0.0, 1.0, frames)])
    return poses_from_rotations(rig.skeleton, local, root_position=np.linspace(0.0, 1.0, frames)[:, None] * [0.4, 1, 2])


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_built_in_hand(tmp_path: Path, hands: dict[str, Rig], side: str) -> None:
    poses = moved(hands[side])
    write_motion(tmp_path / "m.bvh", hands[side], poses, rate=24.0)
    loaded = load_motion(tmp_path / "m.bvh", hands[side])
    assert_same(loaded.poses, poses)
    assert (loaded.rate, loaded.warnings) == (24.0, ())
    assert any("rig's own joints" in note for note in loaded.notes)


@pytest.mark.parametrize("names", [None, ["a", "a", "b", "a", "ear", "ear", "t", "t", "leg", "leg", "leg", "leg"]])
@pytest.mark.parametrize("how", [{}, {"unit": 1000.0}, {"armature": TURNED}, {"armature": FBX, "unit": 100.0}])
def test_rigs_of_files(tmp_path: Path, how: dict, names: list[str] | None) -> None:
    what = animal() if names is None else replace(animal(), names=names)
    path = write(tmp_path / "a.glb", what, {"walk": gait(what)}, **how)
    rig = load_rig(path)
    poses = moved(rig)
    write_motion(tmp_path / "m.bvh", rig, poses, rate=30.0)
    loaded = load_motion(tmp_path / "m.bvh", rig)
    assert_same(loaded.poses, poses)
    assert loaded.warnings == ()


@pytest.mark.parametrize(
    ("name", "motion"),
    [
        ("hand_webxr_generic/left.glb", "motion_leap_grab_pinch_splay/grab.json"),
        ("body_mesh2motion_mannequin/human-male.glb", "motion_cmu_walk_bvh/cmu_12_01_walk.bvh"),
    ],
)
def test_real_rigs(tmp_path: Path, data: Path, name: str, motion: str) -> None:
    rig = load_rig(data / name)
    poses = load_motion(data / motion, rig).poses
    write_motion(tmp_path / "m.bvh", rig, poses, rate=120.0)
    assert_same(load_motion(tmp_path / "m.bvh", rig).poses, poses)


def clip_of(rig: Rig, tmp_path: Path) -> Clip:
    write_motion(tmp_path / "m.bvh", rig, moved(rig), rate=30.0)
    return read_bvh(tmp_path / "m.bvh")


def played(clip: Clip, rig: Rig) -> Poses:
    joined = with_own_joints(rig)
    recording = own_recording(clip, joined)
    assert recording is not None
    own = own_poses(recording.animation, joined)
    assert own is not None
    return own.poses


@pytest.mark.parametrize("turn", [[90, 0, 0], [0, 90, 0], [-90, 0, 90], [10, 20, 30]])
def test_other_axes_and_units(tmp_path: Path, turn: list[float]) -> None:
    """As another program's conversion gives it: all of the file turned and in inches."""
    rig = rigged(body())
    clip = clip_of(rig, tmp_path)
    way = Rotation.from_euler("xyz", turn, degrees=True)
    rotations = (way * Rotation.from_quat(clip.rotations.reshape(-1, 4)) * way.inv()).as_quat()
    other = replace(
        clip,
        rest=39.37 * way.apply(clip.rest),
        positions=39.37 * way.apply(clip.positions.reshape(-1, 3)).reshape(clip.positions.shape),
        rotations=rotations.reshape(clip.rotations.shape),
    )
    assert_same(played(other, rig), moved(rig), 1e-5)


def test_a_rest_that_lies_under_frames_that_stand(tmp_path: Path) -> None:
    """Z is up in the rest and Y in the frames, as some converters leave files: the root carries one to the other."""
    rig = rigged(body())
    draw = np.random.default_rng(3)
    local = Rotation.from_rotvec(draw.normal(0.0, 0.1, (6 * len(rig.skeleton), 3))).as_quat().reshape(6, -1, 4)
    walk = np.linspace(0.0, 1.0, 6)[:, None] * np.array([0.0, 0.0, 2.0])
    poses = poses_from_rotations(rig.skeleton, local, root_position=walk + np.array([0.0, 1.0, 0.0]))
    write_motion(tmp_path / "m.bvh", rig, poses, rate=30.0)
    lying = read_bvh(tmp_path / "m.bvh").turned_rest(np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]))
    assert_same(played(lying, rig), poses)


def test_an_offset_of_the_root_is_where_it_rests(tmp_path: Path) -> None:
    rig = rigged(body())
    clip = clip_of(rig, tmp_path)
    away = np.array([0.0, -rig.skeleton.rest[0, 1] + 0.1, 0.0])
    other = replace(clip, rest=clip.rest + np.array([0.0, 0.1, 0.0]), positions=clip.positions + away)
    assert_same(played(other, rig), moved(rig))


def test_a_node_at_the_origin_above_the_root_does_not_say_where_the_rig_rests(tmp_path: Path) -> None:
    rig = rigged(body())
    clip = clip_of(rig, tmp_path)
    away = np.array([0.0, 0.1, 0.0])  # the file's floor lies lower than the rig's
    pelvis = rig.skeleton.rest[0]
    under = replace(
        clip,
        names=("Reference", *clip.names),
        parents=np.array([-1, *(clip.parents + 1)]),
        rest=np.vstack([np.zeros(3), clip.rest + pelvis + away]),
        positions=np.concatenate([np.zeros((len(clip), 1, 3)), clip.positions + away], axis=1),
        rotations=np.concatenate([np.tile([0.0, 0.0, 0.0, 1.0], (len(clip), 1, 1)), clip.rotations], axis=1),
    )
    assert_same(played(under, rig), moved(rig))


def test_other_rests_and_other_bones_are_another_skeletons(tmp_path: Path) -> None:
    rig = rigged(body())
    clip = clip_of(rig, tmp_path)
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (len(clip.names), 1))
    assert own_recording(clip.rebased(3, turns), with_own_joints(rig)) is None
    longer = clip.rest.copy()
    longer[[name.startswith("left.knee") for name in clip.names]] += [0.0, -0.02, 0.0]
    assert own_recording(replace(clip, rest=longer), with_own_joints(rig)) is None
    assert (
        own_recording(replace(clip, names=tuple(f"j{k}" for k in range(len(clip.names)))), with_own_joints(rig)) is None
    )
