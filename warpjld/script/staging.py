"""Poses of actors at frames, from keys or recorded motion, in world space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.limits import check_limit
from warpjld.script.scene import Actor, Scene
from warpjld.skeleton import Poses
from warpjld.skeleton.between import poses_between
from warpjld.skeleton.streamed_poses import streamed

__all__ = ["frame_numbers", "held", "notes", "stage", "staged"]


def frame_numbers(scene: Scene) -> NDArray[np.float64]:
    """Frames to compute: as FRAMES says, or from the first to the last key of all actors and objects, shape (F,).

    Raises:
        InputError: More frames than the limit ``frames`` allows.
    """
    if scene.first is not None and scene.last is not None:
        return _range(scene.first, scene.last)
    spans = []
    for actor in scene.actors.values():
        if actor.span is not None:
            first, last = actor.span
            if actor.recorded is not None:
                last = max(*actor.key_frames, 0.0, (len(actor.recorded[0]) - 1) * scene.rate / actor.recorded[1])
            spans.append((first, last))
    spans += [(keys[0], keys[-1]) for prop in scene.props.values() if (keys := prop.key_frames)]
    if not spans:
        return np.zeros(1)
    first, last = min(s[0] for s in spans), max(s[1] for s in spans)
    return _range(np.floor(first), np.floor(last + 1e-6))


def _range(first: float, last: float) -> NDArray[np.float64]:
    check_limit(
        "frames", last - first + 1, of=f"frames {first:.0f} to {last:.0f} (FRAMES <first> <last> chooses which)"
    )
    return np.arange(first, last + 1, dtype=np.float64)


def stage(actor: Actor, frames: NDArray[np.float64], rate: float) -> Poses:
    """Poses of an actor at frames (F,), fractions allowed, of a scene with a rate [1/s]."""
    if actor.recorded is None:
        poses = actor.motion.poses(actor.skeleton, frames)
    else:
        recorded, own_rate = actor.recorded
        poses = poses_between(recorded, frames * own_rate / rate)
    return actor.placement.apply(poses, frames)


def staged(actor: Actor, frames: NDArray[np.float64], rate: float) -> Poses:
    """As ``stage``, for many frames: poses are computed lazily, block by block."""
    return streamed(frames, lambda block: stage(actor, block, rate))


def notes(actor: Actor, frames: NDArray[np.float64]) -> list[str]:
    """Notes on an actor's rig and motion for the summary."""
    found = [f"{actor.name}: {note}" for note in (*actor.rig.notes, *actor.motion_notes)]
    if actor.recorded is None:
        found += [f"{actor.name}: {held}" for held in actor.motion.clamped(frames, actor.skeleton)]
    return found


def held(actor: Actor, frames: NDArray[np.float64], rate: float) -> list[str]:
    """Warnings about frames outside a motion file's range, at which its first or last pose is held."""
    if actor.recorded is None:
        return []
    recorded, own_rate = actor.recorded
    last = (len(recorded) - 1) * rate / own_rate
    found = []
    for name, out in (("first", frames[frames < -1e-6]), ("last", frames[frames > last + 1e-6])):
        if len(out):
            which = f"frame {out[0]:g} holds" if len(out) == 1 else f"frames {out[0]:g} to {out[-1]:g} hold"
            found.append(f"{actor.name}: its motion goes from frame 0 to {last:g}: {which} its {name} pose")
    return found
