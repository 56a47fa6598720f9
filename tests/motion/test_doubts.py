"""Warnings of what a rig does not follow, and of flips."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.conventions import FRAMES, record
from tests.motion.skeletons import body, rig
from tests.motion.test_conventions import CONVENTIONS, play
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.clip import Clip
from warpjld.motion.doubts import doubts_of_own_joints, jumps
from warpjld.motion.joint_animation import JointAnimation
from warpjld.skeleton.recognise.tree import SourceTree

MIXAMO = CONVENTIONS["Mixamo"]
CALM = (*FRAMES[:1], {"left.shoulder": (0, -80, 0), "left.hip": (-50, 0, 0)})


def test_what_moves_and_nothing_follows_is_named_once(tmp_path: Path) -> None:
    curl = {f"left.{digit}.{joint}": (0, 0, -30) for digit in ("middle", "ring") for joint in ("base", "knuckle2")}
    moved = play(tmp_path, record(MIXAMO, frames=(*CALM, {**CALM[1], **curl, "left.index.base": (0, 0, -30)})))
    assert moved.warnings == (
        "the motion moves mixamorig:LeftHandMiddle1…mixamorig:LeftHandMiddle2, "
        "mixamorig:LeftHandRing1…mixamorig:LeftHandRing2, which nothing in the rig follows",
    )


def test_what_is_kept_in_place_or_passed_on_is_not(tmp_path: Path) -> None:
    kept = {"left.middle.base": (0.0, 0.0, -30.0)}
    passed = {"spine1": (10, 0, 0), "spine2": (10, 0, 0), "neck1": (0, 20, 0), "left.clavicle": (0, 0, 10)}
    assert play(tmp_path, record(MIXAMO, frames=tuple({**frame, **kept} for frame in CALM))).warnings == ()
    assert play(tmp_path, record(MIXAMO, frames=(*CALM, passed))).warnings == ()
    twisted = record(CONVENTIONS["HumanIK"], frames=(*CALM, {"left.elbow": (60, 0, 0), "left.hip": (0, 40, 0)}))
    assert play(tmp_path, twisted).warnings == (), "parts of limbs carry what drives the rig"


def test_a_single_frame_is_compared_with_the_rest(tmp_path: Path) -> None:
    pose = {"right.pinky.base": (0, 0, 40), "right.elbow": (0, 120, 0)}
    warnings = play(tmp_path, record(MIXAMO, frames=(pose,))).warnings
    assert warnings == ("the motion moves mixamorig:RightHandPinky1, which nothing in the rig follows",)


def test_flips_are_named_with_joint_and_frames_before_resampling(tmp_path: Path) -> None:
    frames = tuple({"left.elbow": (0, -40.0 * f, 0), "head": (0, 100.0 if f > 1 else 0.0, 0)} for f in range(4))
    path = tmp_path / "m.bvh"
    path.write_text(record(MIXAMO, frames=frames).text)
    for rate in (None, 120.0):
        warnings = load_motion(path, rig(body()), rate=rate).warnings
        assert warnings == ("mixamorig:Head turns by 100° from frame 1 to 2 of the recording: a flip?",)


def _turning(turns: np.ndarray) -> Clip:
    """Joints j0, j1, … without parents that turn so, (F, J, 4)."""
    frames, count, _ = turns.shape
    places = np.zeros((frames, count, 3))
    return Clip(tuple(f"j{k}" for k in range(count)), np.full(count, -1), places[0], places, turns, 30.0)


def test_flips_do_not_hang_on_signs_or_on_the_parents_turn() -> None:
    turns = Rotation.from_euler("y", [[0.0], [60.0], [120.0], [180.0], [240.0], [300.0]], degrees=True).as_quat()
    assert jumps(_turning(turns[:, None] * np.array([1, -1, 1, -1, 1, -1])[:, None, None])) == []
    assert jumps(_turning(turns[::2, None])) == ["j0 turns by 120° from frame 0 to 1 of the recording: a flip?"]
    many = jumps(_turning(np.repeat(turns[::2, None], 9, axis=1)))
    assert len(many) == 5
    assert many[-1] == "so do j4…j8, by more than 90° from one frame to the next"


def test_joints_merged_into_others_are_named_where_their_own_animation_moves_them() -> None:
    tree = SourceTree(("hip", "head", "jaw", "twist_l"), np.array([-1, 0, 1, 1]), np.tile(np.eye(4), (4, 1, 1)))
    worlds = np.tile(np.eye(4), (3, 4, 1, 1))
    worlds[:, 2, :3, :3] = Rotation.from_euler("x", [[0.0], [10.0], [20.0]], degrees=True).as_matrix()
    worlds[:, 3, :3, :3] = worlds[:, 2, :3, :3]
    worlds[1, 1, :3, :3] *= -1e-3  # mirrored and small: read as some rotation, without a traceback
    worlds[2, 0, :3, :3] = 0.0
    clip = JointAnimation(tree, worlds, 30.0).clip()
    assert any("moves jaw, which nothing" in line for line in doubts_of_own_joints(clip, {"hip", "head"}))
    assert not any("moves" in line for line in doubts_of_own_joints(clip, {"hip", "head", "jaw"}))


@pytest.mark.parametrize("name", ["body_anny/body_104joints.glb", "body_mesh2motion_mannequin/human-male.glb"])
def test_real_recordings_are_not_suspected_of_flips(data: Path, name: str) -> None:
    driven = load_rig(data / name)
    walk = load_motion(data / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh", driven)
    assert len(walk.warnings) == 1
    assert "the motion moves LeftFingerBase, LeftHandIndex1, LThumb" in walk.warnings[0]
    pose = load_motion(data / "motion_makehuman_benchmark_pose_bvh" / "tpose.bvh", driven)
    assert pose.warnings == ()


def test_far_guesses_are_said(tmp_path: Path) -> None:
    arms = replace(MIXAMO, names={part: name for part, name in MIXAMO.names.items() if "Leg" not in name})
    moved = play(tmp_path, record(arms, frames=CALM))
    assert any("have no legs in common: the scale of its travel is estimated" in note for note in moved.notes)
    assert any("not in the recording, these follow the joint above them: left.hip" in note for note in moved.notes)
