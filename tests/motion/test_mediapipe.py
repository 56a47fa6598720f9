"""MediaPipe's landmarks: every way they are written gives the same motion; gaps are bridged and said."""

from pathlib import Path

import numpy as np
import pytest

from tests.motion.hand_files import camera_landmarks, postures, save
from tests.motion.skeletons import hand, rig
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.hand_file import read_hands
from warpjld.skeleton import Poses

NAMES = ("flat", "relaxed", "fist", "point", "pinch", "spread")


def bends(poses: Poses) -> np.ndarray:
    """Flexions of the second and third knuckles of the fingers [deg], shape (F, 8)."""
    skeleton = hand("right")
    joints = [j for j, n in enumerate(skeleton.names) if n.endswith(("knuckle2", "knuckle3")) and "thumb" not in n]
    return np.degrees(poses.flexion[:, joints])


def landmarks(side: str = "right") -> np.ndarray:
    return camera_landmarks(hand(side), side, postures(hand(side), side, NAMES))


def xyz(points: np.ndarray) -> list[dict]:
    return [{"x": x, "y": y, "z": z, "visibility": 0.0} for x, y, z in points.tolist()]


def in_image(points: np.ndarray, width: float = 640.0, height: float = 480.0) -> np.ndarray:
    """Landmarks in parts of an image, z on the scale of x, seen from afar."""
    return 0.5 + points * 1500.0 / np.array([width, height, width]) * [1, 1, 1] - [0, 0, 0.5]


def written(points: np.ndarray) -> dict[str, object]:
    """One recording as tasks, solutions and scripts write it."""
    image = in_image(points)
    category = [{"index": 0, "score": 0.98, "categoryName": "Right", "displayName": "Right"}]
    label = {"classification": [{"index": 1, "score": 0.97, "label": "Right"}]}
    return {
        "tasks": [
            {"landmarks": [xyz(i)], "worldLandmarks": [xyz(w)], "handedness": [category], "timestamp_ms": 40 * k}
            for k, (i, w) in enumerate(zip(image, points, strict=True))
        ],
        "python tasks": {
            "fps": 25,
            "frames": [
                {"hand_world_landmarks": [xyz(w)], "handedness": [[{"category_name": "Right", "score": 0.9}]]}
                for w in points
            ],
        },
        "solutions": {
            "image_size": [640, 480],
            "frames": [
                {"multi_hand_landmarks": [{"landmark": xyz(i)}], "multi_handedness": [label], "timestamp": 0.04 * k}
                for k, i in enumerate(image)
            ],
        },
        "image": {
            "image_width": 640,
            "image_height": 480,
            "fps": 25.0,
            "handedness": "Right",
            "frames": [{"landmarks": i.tolist()} for i in image],
        },
        "lists": {"landmarks": points.tolist(), "handedness": "right", "fps": 25},
        "holistic": {
            "image_size": [640, 480],
            "fps": 25,
            "frames": [{"left_hand_landmarks": None, "right_hand_landmarks": {"landmark": xyz(i)}} for i in image],
        },
        "holistic task": [
            {
                "rightHandLandmarks": [xyz(i)],
                "rightHandWorldLandmarks": [xyz(w)],
                "leftHandLandmarks": [],
                "time_ms": 40 * k,
            }
            for k, (i, w) in enumerate(zip(image, points, strict=True))
        ],
        "by side": {"fps": 25, "frames": [{"Right": w.tolist()} for w in points]},
        "lists of hands": {
            "fps": 25,
            "frames": [
                [{"keypoints": xyz(i), "keypoints3D": xyz(w), "handedness": "Right"}]
                for i, w in zip(image, points, strict=True)
            ],
        },
        "hands": [
            {"hands": [{"landmarks": xyz(w), "handedness": "Right", "score": 0.8}], "timestamp_us": 40_000 * k}
            for k, w in enumerate(points)
        ],
    }


@pytest.mark.parametrize("how", list(written(landmarks())))
def test_every_way_of_writing_gives_the_same_hand(tmp_path: Path, how: str) -> None:
    loaded = load_motion(save(tmp_path, written(landmarks())[how]), rig(hand("right")))
    wanted = postures(hand("right"), "right", NAMES)
    np.testing.assert_allclose(bends(loaded.poses), bends(wanted), atol=1e-6)
    assert (len(loaded.poses), loaded.rate) == (len(NAMES), 25.0)
    assert loaded.warnings == ()


def test_bare_lists_are_told_apart_by_their_bends_and_play_at_the_rate_asked_for(tmp_path: Path) -> None:
    for side in ("left", "right"):
        path = save(tmp_path, landmarks(side).tolist())
        loaded = load_motion(path, rig(hand(side)))
        np.testing.assert_allclose(bends(loaded.poses), bends(postures(hand("right"), "right", NAMES)), atol=1e-6)
        assert "assumed 30 frames a second" in loaded.notes[0]
        assert f"fingers bend as a {side} hand's" in loaded.notes[-1]
        assert (len(load_motion(path, rig(hand(side)), rate=12).poses), loaded.rate) == (len(NAMES), 30.0)
        np.savez(tmp_path / "a.npz", landmarks=landmarks(side))
        np.save(tmp_path / "a.npy", landmarks(side))
        for name in ("a.npz", "a.npy"):
            same = load_motion(tmp_path / name, rig(hand(side)))
            np.testing.assert_allclose(same.poses.positions, loaded.poses.positions, atol=1e-9)


def test_arrays_of_two_hands_drive_a_body(data: Path, tmp_path: Path) -> None:
    both = np.stack([landmarks("left"), landmarks("right")[::-1]], axis=1)
    times = np.arange(len(NAMES)) * 0.02
    driven = load_rig(data / "body_mesh2motion_mannequin" / "human-male.glb")
    results = []
    for sides in (np.array(["Left", "Right"]), np.array([["Left", "Right"]] * len(NAMES)), None):
        arrays = {"landmarks": both, "timestamps": times} | ({} if sides is None else {"handedness": sides})
        np.savez(tmp_path / "two.npz", **arrays)
        results.append(load_motion(tmp_path / "two.npz", driven))
        assert results[-1].rate == 50.0
    joints = [driven.skeleton.index(f"{s}.middle.knuckle2") for s in ("left", "right")]
    curl = np.degrees(results[0].poses.flexion[:, joints])
    np.testing.assert_allclose(curl[:, 0], curl[::-1, 1], atol=2.0)
    assert curl[2, 0] > 80 > 20 > curl[2, 0] - 80
    for other in results[1:]:
        np.testing.assert_allclose(other.poses.positions, results[0].poses.positions, atol=1e-9)


def test_lost_and_unsure_frames_are_bridged_and_said(tmp_path: Path) -> None:
    poses = postures(hand("right"), "right", ("flat", "flat", "fist", "fist", "fist", "flat", "flat"))
    points = camera_landmarks(hand("right"), "right", poses)
    wanted = bends(
        load_motion(
            save(tmp_path, {"landmarks": points[1:-1].tolist(), "fps": 10, "side": "right"}), rig(hand("right"))
        ).poses
    )
    frames: list = [{"landmarks": xyz(p), "handedness": "Right", "score": 0.9} for p in points]
    frames[0] = None
    frames[3] = {"landmarks": [], "handedness": []}
    frames[2]["score"], frames[2]["landmarks"] = 0.3, xyz(points[0])
    frames[6] = {}
    loaded = load_motion(save(tmp_path, {"fps": 10, "frames": frames}), rig(hand("right")))
    notes = " | ".join(loaded.notes)
    assert "the right hand was lost in 2 frames, at most 2 in a row after frame 1: interpolated" in notes
    assert "seen from frame 1 to 5 of 7: held before and after" in notes
    got = bends(loaded.poses)
    assert len(got) == 7
    np.testing.assert_allclose(got[[0, 1, 4, 5, 6]], wanted[[0, 0, 3, 4, 4]], atol=1e-6)
    assert (got[1] < got[2]).all()
    assert (got[2] < got[3]).all()
    assert (got[3] < got[4]).all()
    arrays = np.where(np.isin(np.arange(7), (0, 2, 3, 6))[:, None, None], np.nan, points)
    np.savez(tmp_path / "nan.npz", landmarks=arrays, fps=10, handedness="Right")
    again = load_motion(tmp_path / "nan.npz", rig(hand("right")))
    np.testing.assert_allclose(again.poses.positions, loaded.poses.positions, atol=1e-9)
    sure = np.ones((7, 21))
    sure[[0, 2, 3, 6]] = 0.1
    sure[4, 8] = 0.2  # the index's tip alone
    shifted = points.copy()
    shifted[4, 8] += 9.0
    np.savez(tmp_path / "sure.npz", world_landmarks=shifted, confidence=sure, fps=10, handedness="Right")
    third = load_motion(tmp_path / "sure.npz", rig(hand("right")))
    assert any("1 unsure landmarks were interpolated" in note for note in third.notes)
    assert np.abs(third.poses.positions).max() < 1.0


def test_selfies_keep_their_label_and_bend_forward(tmp_path: Path) -> None:
    """The older API labels hands as though its image were mirrored: label and shape then contradict each other."""
    content = {"fps": 10, "handedness": "Left", "landmarks": landmarks("right").tolist()}
    loaded = load_motion(save(tmp_path, content), rig(hand("left")))
    np.testing.assert_allclose(bends(loaded.poses), bends(postures(hand("right"), "right", NAMES)), atol=1e-6)
    assert "labelled a left hand, but shaped like a right one" in loaded.warnings[0]
    right = load_motion(save(tmp_path, content), rig(hand("right")), side="right")
    np.testing.assert_allclose(bends(right.poses), bends(postures(hand("right"), "right", NAMES)), atol=1e-6)


def test_flickering_labels_are_one_hand(tmp_path: Path) -> None:
    frames = [
        {"landmarks": p.tolist(), "handedness": "Left" if k == 3 else "Right"}
        for k, p in enumerate(np.tile(landmarks(), (2, 1, 1)))
    ]
    (one,) = (recording := read_hands(save(tmp_path, {"fps": 9, "frames": frames}))).hands
    assert (one.side, len(one.times)) == ("right", 2 * len(NAMES))
    assert "in 1 frames the other: read as right" in recording.notes[0]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"frames": [{"landmarks": [[0, 0, 0]] * 20}]}, "frame 0: not hands of 21 landmarks"),
        ({"frames": [{"landmarks": [[0, 0, 0]] * 21, "handedness": "up"}]}, "frame 0: .*handedness 'up'"),
        ({"frames": [{"landmarks": [[0, "a", 0]] * 21}]}, "frame 0: not hands"),
        ({"frames": [{"landmarks": [{"x": 1, "y": 2}] * 21}]}, "frame 0: not hands"),
        ({"frames": [{"landmarks": []}]}, "no frame holds a hand"),
        ({"fps": -1, "frames": [{"landmarks": [[0, 0, 0]] * 21}]}, "want frames a second"),
        ({"image_size": [0, 1], "frames": [{"landmarks": [[0, 0, 0]] * 21}]}, "image_size: want width and height"),
        (
            {"frames": [{"landmarks": [[1e99, 0, 0]] * 21}]},
            "'wrist' lies absurdly far away at frame 0",
        ),
        (
            {"frames": [{"landmarks": [[0, 0, 0]] * 21, "time": t} for t in (1, 0)]},
            "frame 1: its timestamp is not a time after",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, content: object, message: str) -> None:
    with pytest.raises(InputError, match=f"hand.json: {message}"):
        read_hands(save(tmp_path, content))


def test_hands_of_one_point_are_refused(tmp_path: Path) -> None:
    path = save(tmp_path, {"landmarks": [[[0.5, 0.5, 0.0]] * 21], "handedness": "left"})
    with pytest.raises(InputError, match="palm lie in a line or a point at frame 0"):
        load_motion(path, rig(hand("left")))


def test_arrays_that_are_no_landmarks_are_refused(tmp_path: Path) -> None:
    for arrays, message in (
        ({"landmarks": np.zeros((3, 21, 2))}, r"want numbers of shape \(frames, 21, 3\)"),
        ({"landmarks": np.zeros((3, 21, 3)), "confidence": np.zeros((2, 5))}, r"'confidence': shape \(2, 5\)"),
        ({"joints": np.zeros((3, 9))}, r"holds 'joints' \(3, 9\)"),
    ):
        np.savez(tmp_path / "a.npz", **arrays)
        with pytest.raises(InputError, match=message):
            read_hands(tmp_path / "a.npz")
