"""Recordings with anything in the wrong place: one line of what is wrong, never a traceback or a NaN."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.motion.hand_files import camera_landmarks, postures, save, webxr_poses
from tests.motion.skeletons import hand, rig
from tests.motion.test_hand_sides import leap_frames
from warpjld.errors import InputError
from warpjld.motion import load_motion

JUNK: tuple[Any, ...] = (None, 5, -1.5, 1e300, "x", "", True, [], {}, [1, 2, 3], [[]], {"a": 1}, float("nan"), [None])


def recordings() -> dict[str, Any]:
    skeleton = hand("left")
    poses = postures(skeleton, "left", ("flat", "fist", "point"))
    points = camera_landmarks(skeleton, "left", poses)
    point = [[{"x": x, "y": y, "z": z} for x, y, z in row] for row in points.tolist()]
    zeros = [[0.1] * 45] * 3
    return {
        "webxr": {"handedness": "left", **webxr_poses(skeleton, "left", poses, ("a", "b", "c"))},
        "leap": leap_frames(skeleton, {"left": poses.positions}),
        "mediapipe": {
            "fps": 9,
            "image_size": [4, 3],
            "frames": [{"landmarks": p, "handedness": "Left"} for p in point],
        },
        "tasks": [
            {"landmarks": [p], "handedness": [[{"score": 0.9, "categoryName": "Left"}]], "timestamp_ms": k, "score": 1}
            for k, p in enumerate(point)
        ],
        "mano": {"hand_pose": zeros, "global_orient": [[0, 0, 0]] * 3, "transl": [[0, 0, 0]] * 3, "side": "left"}
        | {"flat_hand_mean": True, "fps": 30, "joint_order": [f"{d}{k}" for d in ORDER for k in (1, 2, 3)]},
        "manos": {"flat_hand_mean": False, "hands_mean": [0.0] * 45, "frames": [{"left_hand_pose": [0.1] * 45}] * 3},
    }


ORDER = ("index", "middle", "pinky", "ring", "thumb")


def places(content: Any) -> list[tuple[Any, Any]]:
    """Every container of a JSON value with each of its keys."""
    pairs: list[tuple[Any, Any]] = []
    keys = list(content) if isinstance(content, dict) else range(len(content)) if isinstance(content, list) else ()
    for key in keys:
        pairs += [(content, key), *places(content[key])]
    return pairs


@pytest.mark.parametrize("kind", list(recordings()))
def test_junk_anywhere_is_refused_or_read_without_nan(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(0)
    text = json.dumps(recordings()[kind])
    driven = rig(hand("left"))
    for trial in range(60):
        content = json.loads(text)
        pairs = places(content)
        if trial % 2:  # near the top, where there are few places
            pairs = [pair for pair in pairs if pair[0] is content]
        container, key = pairs[rng.integers(len(pairs))]
        if isinstance(container, dict) and rng.random() < 0.1:
            del container[key]
        else:
            container[key] = JUNK[rng.integers(len(JUNK))]
        path = save(tmp_path, content)
        try:
            poses = load_motion(path, driven).poses.positions
        except InputError as error:
            message = str(error)
        else:
            message = f"{path}: read"
            assert np.isfinite(poses).all(), content
        assert message.startswith(str(path))
