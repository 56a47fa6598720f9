"""Actors at frames: keys or recorded motion → poses on the stage."""

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
    """The frames to make: FRAMES, or from the first to the last key of all actors and objects; shape (F,).

    Raises:
        InputError: More than the limit ``frames`` allows.
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
    """Poses of an actor at any frames, whole or not, of a scene with that rate [1/s]."""
    if actor.recorded is None:
        poses = actor.motion.poses(actor.skeleton, frames)
    else:
        recorded, own_rate = actor.recorded
        poses = poses_between(recorded, frames * own_rate / rate)
    return actor.placement.apply(poses, frames)


def staged(actor: Actor, frames: NDArray[np.float64], rate: float) -> Poses:
    """As ``stage``, of so many frames that their poses are computed a block at a time, when they are looked at."""
    return streamed(frames, lambda some: stage(actor, some, rate))


def notes(actor: Actor, frames: NDArray[np.float64]) -> list[str]:
    """What a reader of the result should know of an actor's rig and motion."""
    found = [f"{actor.name}: {note}" for note in (*actor.rig.notes, *actor.motion_notes)]
    if actor.recorded is None:
        found += [f"{actor.name}: {held}" for held in actor.motion.clamped(frames, actor.skeleton)]
    return found


def held(actor: Actor, frames: NDArray[np.float64], rate: float) -> list[str]:
    """Warnings of frames that a motion file does not reach, in which its first or last pose is held."""
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
