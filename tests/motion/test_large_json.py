"""Recordings in JSON that are too large to be read whole give the same hands."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.motion.hand_files import postures, webxr_poses
from tests.motion.skeletons import hand
from tests.motion.test_broken_recordings import recordings
from tests.motion.test_hand_sides import leap_frames
from warpjld.errors import InputError
from warpjld.files.json_pieces import json_pieces
from warpjld.motion import hand_file
from warpjld.motion.hand_file import read_hands
from warpjld.motion.hand_motion import HandRecording


def more() -> dict[str, Any]:
    """Recordings of all kinds and layouts."""
    found = recordings()
    frames = found["mediapipe"]["frames"]
    points = [[[one["x"], one["y"], one["z"]] for one in frame["landmarks"]] for frame in frames]
    skeleton = hand("left")
    poses = postures(skeleton, "left", ("flat", "fist", "point"))
    leap = leap_frames(skeleton, {"left": poses.positions})
    mano = {"flat_hand_mean": True, "side": "right"}
    return found | {
        "points": points,
        "named": {"world_landmarks": points, "timestamps": [0.0, 0.1, 0.3], "handedness": "Left"},
        "last": {"frames": leap["frames"], "made": "by hand"},
        "packed": {"frames": [["timestamp", {"hands": [["id", "type"]]}], *([k, []] for k in range(3))]},
        "sides": {"handedness": "left", "all": webxr_poses(skeleton, "left", poses, ("a", "b", "c"))},
        "joints": mano | {"frames": [{"hand_pose": [[0.1, 0.2, k / 9]] * 15, "time": k} for k in range(4)]},
        "both": {"flat_hand_mean": True, "left": {"pose": [[0.1] * 48] * 3}, "right": {"pose": [[0.2] * 48] * 3}},
        "rows": mano | {"poses": [[0.01 * k] * 45 for k in range(2500)]},
    }


def hands(path: Path) -> Any:
    """Everything a recording holds, or its refusal."""
    try:
        return told(read_hands(path))
    except InputError as error:
        return error.message


def told(recording: HandRecording) -> list[Any]:
    out: list[Any] = [recording.rate, recording.notes, recording.warnings]
    for track in recording.hands:
        arrays = track.points if hasattr(track, "points") else vars(track)
        out += [track.side, track.times.tolist()]
        out += [(name, np.asarray(value).tolist()) for name, value in arrays.items()]
    return out


@pytest.mark.parametrize("kind", list(more()))
def test_a_recording_read_piecewise_gives_the_same_hands(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = more()[kind]
    path = tmp_path / "a.json"
    path.write_text(json.dumps(content))
    whole = hands(path)
    monkeypatch.setattr(hand_file, "json_pieces", partial(json_pieces, piece=300))
    monkeypatch.setenv("WARPJLD_LIMIT_JSON_BYTES", "20")
    assert hands(path) == whole
    if isinstance(content, list):
        lines = tmp_path / "a.jsonl"
        lines.write_text("\n".join(json.dumps(frame) for frame in content))
        assert hands(lines) == whole
    path.write_text(path.read_text()[:-20])
    assert "is not JSON" in hands(path)
