"""Long recordings are read and played a block at a time: bit for bit what all frames at once are, in little memory."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.finger import finger
from tests.fuzz.sound import _skinned
from tests.motion import skinned_files
from tests.motion.conventions import record
from tests.motion.hand_files import camera_landmarks, postures
from tests.motion.skeletons import body, hand, rig
from tests.motion.test_conventions import CONVENTIONS
from tests.peak import peak
from warpjld.covering import bind_rig
from warpjld.files.spilled_rows import SpilledRows
from warpjld.io import load_rig
from warpjld.motion.bvh import read_bvh
from warpjld.motion.clip import StreamedClip
from warpjld.motion.load import LoadedMotion, load_motion
from warpjld.motion.out import write_motion
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.streamed_poses import BLOCK, StreamedPoses
from warpjld.touch import Touch, close_until_touch

_COUNT = BLOCK + 77


def _long(folder: Path) -> Path:
    """A recorded body of many frames, which sways."""
    pose = {"left.elbow": (0, -40, 0), "spine1": (5, 0, 10)}
    head, _, frames = record(CONVENTIONS["Mixamo"], frames=(pose,)).text.partition("Frames:")
    numbers = np.array(frames.split("\n", 2)[2].split(), dtype=np.float64)
    rng = np.random.default_rng(2)
    rows = numbers + np.sin(np.linspace(0.0, 9.0, _COUNT))[:, None] * rng.uniform(0.0, 8.0, len(numbers))
    path = folder / "long.bvh"
    lines = "\n".join(" ".join(f"{x:.4f}" for x in row) for row in rows)
    path.write_text(f"{head}Frames: {_COUNT}\nFrame Time: 0.033333\n{lines}\n")
    return path


def _is_streamed(moved: LoadedMotion, count: int = _COUNT) -> None:
    poses = moved.poses
    assert isinstance(poses, StreamedPoses)
    assert len(poses) == count
    whole = Poses(poses.positions, poses.rotations, poses.flexion)
    for part in (slice(0, 16), slice(BLOCK - 3, BLOCK + 5), slice(count - 2, count)):
        for name in ("positions", "rotations", "flexion"):
            np.testing.assert_array_equal(getattr(poses[part], name), getattr(whole[part], name))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _long(tmp_path_factory.mktemp("long"))


@pytest.mark.parametrize("rate", [None, 47.0])
def test_a_recording_of_another_skeleton(recorded: Path, rate: float | None) -> None:
    count = _COUNT if rate is None else int(np.floor((_COUNT - 1) / 30.0 * rate + 1e-6)) + 1
    _is_streamed(load_motion(recorded, rig(body()), rate=rate), count)


def test_frames_of_a_streamed_clip_are_those_of_a_plain_one(recorded: Path) -> None:
    clip = read_bvh(recorded)
    assert isinstance(clip, StreamedClip)
    plain, part = clip.plain(), slice(BLOCK - 40, BLOCK + 40)
    turn = np.array([0.5, 0.5, 0.5, 0.5])
    for one, other in (
        (clip, plain),
        (clip.at_rate(47.0), plain.at_rate(47.0)),
        (clip.turned_rest(turn), plain.turned_rest(turn)),
    ):
        np.testing.assert_array_equal(one[part].positions, other[part].positions)
        np.testing.assert_array_equal(one[part].rotations, other[part].rotations)
    assert clip.stating(notes=("a",)).notes == ("a",)


def test_an_animation_of_the_rigs_own_joints(tmp_path: Path) -> None:
    times = (np.arange(_COUNT) / 30.0).astype(np.float32)
    turns = Rotation.from_euler("x", np.linspace(0.0, -1.2, _COUNT)[:, None]).as_quat().astype(np.float32)
    path = tmp_path / "a.glb"
    skinned_files.write(path, _skinned(), {"bend": {(1, "rotation"): (times, turns, "LINEAR")}})
    _is_streamed(load_motion(path, load_rig(path)))


def test_a_tracked_hand(tmp_path: Path) -> None:
    skeleton = hand("left")
    ends = camera_landmarks(skeleton, "left", postures(skeleton, "left", ("flat", "fist")))
    share = np.linspace(0.0, 0.15, _COUNT)[:, None, None]
    np.save(tmp_path / "a.npy", (1 - share) * ends[0] + share * ends[1])
    moved = load_motion(tmp_path / "a.npy", rig(skeleton))
    _is_streamed(moved)
    write_motion(tmp_path / "mano.npz", rig(skeleton), moved.poses, rate=30.0)
    _is_streamed(load_motion(tmp_path / "mano.npz", rig(skeleton)))


def test_limited_digits_of_a_finger_that_touches_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.skeleton.streamed_poses.BLOCK", 5)
    covering = bind_rig(finger())
    frames = np.zeros((8, len(covering.skeleton), 4))
    poses = poses_from_angles(covering.skeleton, frames)
    limited, told = close_until_touch(covering, poses, Touch.of(covering))
    assert isinstance(limited, StreamedPoses)
    np.testing.assert_array_equal(limited[3:7].rotations, poses[3:7].rotations)
    assert len(told) == 0


def test_rows_beyond_memory_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.files.spilled_rows._IN_MEMORY", 1000)
    rows, all_rows = SpilledRows(3), np.random.default_rng(1).normal(size=(500, 3))
    for start in range(0, 500, 7):
        rows.extend(all_rows[start : start + 7])
    assert len(rows) == 500
    np.testing.assert_array_equal(rows[113:290], all_rows[113:290])
    np.testing.assert_array_equal(np.concatenate(list(rows.blocks())), all_rows)
    assert rows[490:400].shape == (0, 3)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the most memory a process held is not told there")
@pytest.mark.parametrize("out", ["bvh", "glb", "npz"])
def test_a_hundred_thousand_recorded_frames_take_450_mb(recorded: Path, tmp_path: Path, out: str) -> None:
    head, _, rest = recorded.read_text().partition("Frames:")
    rows = rest.split("\n", 2)[2].splitlines()
    with (tmp_path / "m.bvh").open("w") as file:
        file.write(f"{head}Frames: 100000\nFrame Time: 0.033333\n")
        file.writelines(f"{rows[k % len(rows)]}\n" for k in range(100_000))
    arguments = ["deform", "builtin:left", "--motion", "m.bvh", "--motion-out", f"o.{out}"]
    assert peak(*arguments, folder=tmp_path) < 450.0
