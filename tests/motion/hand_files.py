"""Poses of hands, and files of them as trackers write them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.motion.mediapipe import MEDIAPIPE_JOINTS
from warpjld.motion.webxr import WEBXR_JOINTS
from warpjld.skeleton import Poses, Skeleton, poses_from_angles

_CURLED = {"base": 75.0, "knuckle2": 95.0, "knuckle3": 60.0}
_POSTURES: dict[str, dict[str, float]] = {
    "fist": {f"{f}.{j}": a for f in ("index", "middle", "ring", "pinky") for j, a in _CURLED.items()}
    | {"thumb.base": 10.0, "thumb.knuckle2": 30.0, "thumb.knuckle3": 40.0},
    "point": {f"{f}.{j}": a for f in ("middle", "ring", "pinky") for j, a in _CURLED.items()},
    "flat": {},
    "spread": {},
    "pinch": {"index.base": 40.0, "index.knuckle2": 50.0, "index.knuckle3": 25.0, "thumb.knuckle3": 30.0},
    "relaxed": {
        f"{f}.{j}": a
        for f in ("index", "middle", "ring", "pinky")
        for j, a in (("base", 20.0), ("knuckle2", 25.0), ("knuckle3", 15.0))
    },
}
POSTURES = tuple(_POSTURES)
_SPREAD = {"index": 18.0, "middle": 3.0, "ring": -9.0, "pinky": -18.0}


def postures(skeleton: Skeleton, side: str, names: tuple[str, ...]) -> Poses:
    """Named postures of one hand of a skeleton, one a frame."""
    angles = np.zeros((len(names), len(skeleton), 4))
    for frame, name in enumerate(names):
        for joint, flexion in _POSTURES[name].items():
            angles[frame, skeleton.index(f"{side}.{joint}"), 0] = np.radians(flexion)
        for finger, lean in _SPREAD.items() if name == "spread" else ():
            angles[frame, skeleton.index(f"{side}.{finger}.base"), 3] = np.radians(lean)
    return poses_from_angles(skeleton, angles)


def webxr_poses(skeleton: Skeleton, side: str, poses: Poses, names: tuple[str, ...]) -> dict[str, dict[str, object]]:
    """Poses as WebXR joints."""
    out: dict[str, dict[str, object]] = {}
    for name, positions in zip(names, poses.positions, strict=True):
        out[name] = {}
        for joint, canonical in WEBXR_JOINTS.items():
            matrix = np.eye(4)
            matrix[:3, 3] = positions[skeleton.index(f"{side}.{canonical}")]
            out[name][joint] = {"offsetMatrix": matrix.T.ravel().tolist(), "radius": 0.01}
    return out


def camera_landmarks(skeleton: Skeleton, side: str, poses: Poses) -> NDArray[np.float64]:
    """The 21 landmarks in a camera's axes (x right, y down, z away) about the hand's centre, shape (F, 21, 3)."""
    points = poses.positions[:, [skeleton.index(f"{side}.{name}") for name in MEDIAPIPE_JOINTS]]
    return (points - points.mean(axis=1, keepdims=True)) * [1.0, -1.0, -1.0]


def save(folder: Path, content: object, name: str = "hand.json") -> Path:
    """A JSON file."""
    path = folder / name
    path.write_text(json.dumps(content))
    return path
