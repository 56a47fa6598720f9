"""Loading of any motion file as poses of a rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.geometry.lengths import check_size
from warpjld.motion.clip import Clip
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.tracks import Limits
from warpjld.rig import Rig
from warpjld.runtime.lazily import imported
from warpjld.skeleton import Poses
from warpjld.skeleton.streamed_poses import blocks_of, streamed

__all__ = ["MOTION_FORMATS", "LoadedMotion", "load_motion"]

MOTION_FORMATS = {
    ".csv": "key angles of joints by frame, degrees",
    ".bvh": "motion capture",
    ".glb": "an animation in a binary glTF file",
    ".gltf": "an animation in a glTF file",
    ".fbx": "an animation in an FBX file",
    ".vrma": "a VRM animation",
    ".usd": "a UsdSkel animation",
    ".usda": "a UsdSkel animation in USD as text",
    ".usdc": "a UsdSkel animation in binary USD",
    ".usdz": "a UsdSkel animation in a USD package",
    ".json": "tracked hands: WebXR poses, a Leap Motion recording, MediaPipe landmarks, MANO poses",
    ".jsonl": "tracked hands: MediaPipe landmarks or MANO poses, a frame a line",
    ".npz": "tracked hands: MANO poses or MediaPipe landmarks as NumPy arrays",
    ".npy": "a tracked hand: MANO poses or MediaPipe landmarks as one NumPy array",
}
"""Suffix → description, for help texts."""


@dataclass(frozen=True, eq=False)
class LoadedMotion:
    """Poses of a rig from a motion file.

    Attributes:
        poses: The rig's poses, one per frame.
        rate: Frames a second.
        notes: What drives what, and angles held at limits, for the user.
        warnings: What of the motion is not followed, and what looks wrong; every command prints them on stderr.
    """

    poses: Poses
    rate: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        doubts = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"LoadedMotion({len(self.poses)} frames at {self.rate:g} a second{doubts})"


def load_motion(
    path: str | Path,
    rig: Rig,
    *,
    rate: float | None = None,
    limits: Limits = "error",
    side: str | None = None,
    animation: str | None = None,
    flat_hand_mean: bool | None = None,
) -> LoadedMotion:
    """Read a motion file for a rig; the suffix determines its kind (see ``MOTION_FORMATS``).

    Tables of angles are interpolated by Kochanek–Bartels splines from the first key to the last. Joint limits apply to
    them only: captured rotations are used as they are.

    Args:
        path: The file.
        rig: Rig to pose; see ``read_csv``, ``retarget``, ``own_poses`` and ``poses_of_hands`` for how.
        rate: Frames a second of the result; None for the file's own, or 30 for tables, which have none. A table's
            frames are played at that rate, all other motions are resampled to it.
        limits: What to do with angles beyond a joint's limit, see ``Motion.sample``.
        side: ``left`` or ``right``: side of a recorded hand, if its file does not state it or is wrong; of a recording
            of both, the hand to use.
        animation: Name of one of the file's animations; None for the first.
        flat_hand_mean: Whether zero rotations of MANO poses mean the flat hand (True) or MANO's mean pose (False), if
            the file does not state it.

    Raises:
        InputError: An unknown suffix, or a file that cannot be read or does not fit the rig.

    Examples:
        >>> from tempfile import mkdtemp
        >>> file = Path(mkdtemp()) / "bend.csv"
        >>> _ = file.write_text("frame,index.base.flexion\\n0,0\\n10,60\\n")  # degrees
        >>> moved = wj.load_motion(file, wj.build_hand("left", resolution=1500), rate=25)
        >>> moved
        LoadedMotion(11 frames at 25 a second)
    """
    path = Path(path)
    if rate is not None and not (np.isfinite(rate) and rate > 0.0):
        raise InputError(f"rate: want frames a second, above 0, got {rate:g}")
    suffix = path.suffix.lower()
    if suffix in (".pkl", ".pickle"):
        raise InputError(
            "contains pickled Python objects, which may run any code, and is not read; "
            "save plain arrays as .npz, or JSON",
            path=path,
        )
    if suffix not in MOTION_FORMATS:
        known = ", ".join(f"{s} ({what})" for s, what in MOTION_FORMATS.items())
        raise InputError(f"unknown kind of motion '{path.suffix}'; known: {known}", path=path)
    if animation is not None and suffix not in _ANIMATIONS:
        raise InputError(f"no animation '{animation}': a {suffix} file holds one motion without a name", path=path)
    check_input(path)
    with reading(path, f"a motion ({suffix})"):
        if suffix == ".csv":
            moved = _table(path, rig, rate, limits)
        elif suffix == ".bvh":
            moved = _capture(path, rig, rate)
        elif suffix in (".json", ".jsonl", ".npz", ".npy"):
            moved = _tracked_hands(path, rig, rate, side, flat_hand_mean)
        else:
            moved = _animation(path, rig, rate, animation)
        _check_poses(moved.poses)
    return moved


def _check_poses(poses: Poses) -> None:
    """Make sure that poses lie where surfaces can be computed."""
    for first, some in blocks_of(poses):
        check_size(some.positions, "the motion", "its unit", least=0.0)
        if not np.isfinite(some.rotations).all():
            frame, joint = np.argwhere(~np.isfinite(some.rotations))[0][:2]
            raise InputError(f"the rotation of joint {joint} is not finite at frame {first + frame}")


def _animation(path: Path, rig: Rig, rate: float | None, name: str | None) -> LoadedMotion:
    from warpjld.motion.doubts import doubts_of_own_joints, jumps
    from warpjld.motion.own_joints import own_poses

    read: Callable[..., JointAnimation] = imported(_ANIMATIONS[path.suffix.lower()])
    animation = read(path, rate=rate, name=name)
    own = own_poses(animation, rig)
    clip = animation.clip().stating(notes=animation.notes)
    # flips are searched at the file's rate: resampling may hide or create them
    recorded = clip if rate is None else read(path, name=name).clip()
    flips = jumps(recorded)
    if own is None:
        moved = _retargeted(clip, rig, animation.rate, flips)
        return replace(moved, warnings=(*animation.warnings, *moved.warnings))
    doubts = (*flips, *doubts_of_own_joints(clip, set(rig.source_joints)))
    notes, warnings = (*animation.notes, *own.notes), (*animation.warnings, *own.warnings, *doubts)
    return LoadedMotion(own.poses, animation.rate, notes, warnings)


def _retargeted(clip: Clip, rig: Rig, rate: float | None, flips: list[str]) -> LoadedMotion:
    """A clip of any skeleton retargeted to a rig and resampled; ``flips`` were found before resampling."""
    from warpjld.motion.doubts import doubts_of_clip
    from warpjld.motion.retarget import retarget_and_tell

    clip = clip if rate is None else clip.at_rate(rate)
    moved = retarget_and_tell(clip, rig.skeleton)
    warnings = (*clip.warnings, *moved.warnings, *flips, *doubts_of_clip(clip, moved.used))
    return LoadedMotion(moved.poses, clip.rate, (*clip.notes, *moved.notes), warnings)


_GLTF = ("warpjld.motion.gltf_animation", "read_gltf_animation")
_USD = ("warpjld.motion.separate_usd", "load_usd_animation")
_ANIMATIONS = {
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".fbx": ("warpjld.motion.fbx_animation", "read_fbx_animation"),
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
    ".usdz": _USD,
    ".vrma": ("warpjld.motion.vrma", "read_vrma"),
}
"""Suffix → reader of animations, called with the file, ``rate`` and ``name``."""


def _table(path: Path, rig: Rig, rate: float | None, limits: Limits) -> LoadedMotion:
    from warpjld.motion.csv_file import read_csv

    motion = read_csv(path, skeleton=rig.skeleton, **({} if rate is None else {"rate": rate}))
    poses = streamed(motion.frames, lambda frames: motion.poses(rig.skeleton, frames, limits=limits))
    held = () if limits == "ignore" else motion.clamped(motion.frames, rig.skeleton)
    return LoadedMotion(poses, motion.rate, tuple(str(one) for one in held))


def _capture(path: Path, rig: Rig, rate: float | None) -> LoadedMotion:
    from warpjld.motion.bvh import read_bvh
    from warpjld.motion.doubts import doubts_of_clip, jumps
    from warpjld.motion.own_joints import own_poses
    from warpjld.motion.own_recording import own_recording, with_own_joints

    clip = read_bvh(path)
    joined = with_own_joints(rig)
    recording = own_recording(clip if rate is None else clip.at_rate(rate), joined)
    own = None if recording is None else own_poses(recording.animation, joined)
    flips = jumps(clip)
    if recording is None or own is None:
        return _retargeted(clip, rig, rate, flips)
    note = "the recording is of the rig's own joints: their motion is used directly"
    warnings = (
        *clip.warnings,
        *own.warnings,
        *flips,
        *doubts_of_clip(clip, recording.followed),
    )
    return LoadedMotion(
        own.poses, recording.animation.rate, (*clip.notes, note, *recording.notes, *own.notes), warnings
    )


def _tracked_hands(
    path: Path, rig: Rig, rate: float | None, side: str | None, flat_hand_mean: bool | None
) -> LoadedMotion:
    from warpjld.motion.hand_file import read_hands
    from warpjld.motion.hands_drive import poses_of_hands

    recording = read_hands(path, rate=rate, flat_hand_mean=flat_hand_mean)
    rate = recording.rate if rate is None else rate
    poses, notes, warnings = poses_of_hands(recording.hands, rig.skeleton, rate, side=side)
    return LoadedMotion(poses, rate, (*recording.notes, *notes), (*recording.warnings, *warnings))
