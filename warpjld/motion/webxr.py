"""WebXR hand poses: named poses of 25 joints, each a 4 × 4 matrix in metres, stored by columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.hand_track import HandTrack
from warpjld.skeleton import DIGITS

__all__ = ["WEBXR_JOINTS", "webxr_track"]

WEBXR_JOINTS = {"wrist": "wrist"} | {
    f"{name}-{part}": f"{digit}.{joint}"
    for digit in DIGITS
    for name, parts in (
        ("thumb", ("metacarpal", "phalanx-proximal", "phalanx-distal", "tip"))
        if digit == "thumb"
        else (
            f"{digit}-finger",
            ("metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip"),
        ),
    )
    for part, joint in zip(
        parts,
        ("base", "knuckle2", "knuckle3", "tip")
        if digit == "thumb"
        else ("carpometacarpal", "base", "knuckle2", "knuckle3", "tip"),
        strict=True,
    )
}
"""WebXR Hand Input joint → canonical joint without the side."""


def webxr_track(content: Mapping[str, Any]) -> tuple[HandTrack, float]:
    """Poses in the file's order, a second apart. The side is read from the hand's shape, as the file does not say it.

    Poses are relative to a controller's grip, so only the fingers count.

    Raises:
        InputError: A joint is missing or its matrix is not one, by name.
    """
    from warpjld.skeleton.recognise.hand_frame import chirality

    poses = [
        {canonical: _place(name, pose, joint) for joint, canonical in WEBXR_JOINTS.items()}
        for name, pose in content.items()
        if isinstance(pose, Mapping)
    ]
    points = {joint: np.array([pose[joint] for pose in poses]) for joint in WEBXR_JOINTS.values()}
    side = "right" if sum(chirality(pose) for pose in poses) > 0.0 else "left"
    return HandTrack(side, np.arange(len(poses), dtype=np.float64), points, moves=False), 1.0


def _place(pose_name: str, pose: Mapping[str, Any], joint: str) -> NDArray[np.float64]:
    try:
        matrix = np.array(pose[joint]["offsetMatrix"], dtype=np.float64)
    except KeyError as error:
        raise InputError(f"pose '{pose_name}': no '{joint}' with an 'offsetMatrix'") from error
    except (TypeError, ValueError) as error:
        raise InputError(f"pose '{pose_name}': the offsetMatrix of '{joint}' is not 16 numbers") from error
    if matrix.shape != (16,) or not np.isfinite(matrix).all():
        raise InputError(f"pose '{pose_name}': the offsetMatrix of '{joint}' is not 16 finite numbers")
    return matrix[12:15]
