"""Any motion file → poses of a rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.motion.bvh import read_bvh
from warpjld.motion.csv_file import read_csv
from warpjld.motion.tracks import Limits
from warpjld.rig import Rig
from warpjld.skeleton import Poses

__all__ = ["MOTION_FORMATS", "load_motion"]

MOTION_FORMATS = {
    ".csv": "key angles of joints by frame, degrees",
    ".bvh": "motion capture",
    ".glb": "an animation in a binary glTF file",
    ".gltf": "an animation in a glTF file",
    ".json": "a tracked hand: WebXR poses or a Leap Motion recording",
}
"""What each suffix is, for help texts."""


def load_motion(
    path: str | Path, rig: Rig, *, rate: float | None = None, limits: Limits = "error"
) -> tuple[Poses, float]:
    """Poses of a rig from a motion file; the suffix says which kind (see ``MOTION_FORMATS``).

    Tables of angles are drawn by Kochanek–Bartels splines from the first key to the last, and are the only ones that
    joint limits apply to: captured rotations are taken as they are.

    Args:
        path: The file.
        rig: What is driven; see ``read_csv``, ``retarget``, ``poses_of_gltf`` and ``poses_of_hand`` for how.
        rate: Frames a second of the result; None for the file's own, or 25 for tables, which have none. A table's
            frames are played at that rate, all others are resampled to it.
        limits: What to do with angles beyond a joint's limit, see ``Motion.sample``.

    Returns:
        The poses, and their frames a second.

    Raises:
        InputError: An unknown suffix, a file that cannot be read or understood, or that does not fit the rig.
    """
    path = Path(path)
    if rate is not None and not (np.isfinite(rate) and rate > 0.0):
        raise InputError(f"rate: want frames a second, above 0, got {rate:g}")
    suffix = path.suffix.lower()
    if suffix not in MOTION_FORMATS:
        known = ", ".join(f"{s} ({what})" for s, what in MOTION_FORMATS.items())
        raise InputError(f"unknown kind of motion '{path.suffix}'; known: {known}", path=path)
    try:
        return _load(path, suffix, rig, rate, limits)
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(error.message, path=path) from error


def _load(path: Path, suffix: str, rig: Rig, rate: float | None, limits: Limits) -> tuple[Poses, float]:
    if suffix == ".csv":
        motion = read_csv(path, skeleton=rig.skeleton, **({} if rate is None else {"rate": rate}))
        return motion.poses(rig.skeleton, limits=limits), motion.rate
    if suffix == ".bvh":
        from warpjld.motion.retarget import retarget

        clip = read_bvh(path)
        clip = clip if rate is None else clip.at_rate(rate)
        return retarget(clip, rig.skeleton), clip.rate
    if suffix == ".json":
        from warpjld.motion.hand_track import poses_of_hand
        from warpjld.motion.json_file import read_hand_track

        track, own_rate = read_hand_track(path)
        rate = own_rate if rate is None else rate
        return poses_of_hand(track, rig.skeleton, rate), rate
    from warpjld.motion.gltf_animation import poses_of_gltf

    return poses_of_gltf(path, rig, rate=rate)
