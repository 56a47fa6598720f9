"""The way of an arm between two keys: where it passes through the body, and keys that lead it around (A §7, R90)."""

from __future__ import annotations

import math
from copy import deepcopy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.script.binding import cover
from warpjld.script.grasping import posture
from warpjld.script.staging import stage
from warpjld.skeleton import CHANNELS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from warpjld.covering import Covering
    from warpjld.motion.tracks import Track
    from warpjld.script.scene import Actor, Scene
    from warpjld.skeleton.arm import Arm

__all__ = ["clear_way", "key_arm", "pierced_frames"]

_TRIED = 3  # largest number of postures to go by that are tried
_OUTSIDE, _APPROACH = 0.04, 0.75
"""Distance from the body at which the arm is before it comes to its goal [m], and when, as a share of the time."""
_NUDGES = 3  # largest number of keys that then move the arm out of the body where it still passes through
_MARGIN = 0.01  # added to the radii of the arm's spheres on the way [m], since splines swing past their keys; once more
# at each further key that moves the arm out
_LOOKS = 61
"""Largest number of frames of the motion at which intersections of the arm with the body are looked for: every frame
of a motion of two seconds."""


def key_arm(scene: Scene, actor: Actor, arm: Arm, frame: float, values: NDArray[np.float64]) -> None:
    """Set keys of all free angles of an arm [rad]."""
    for (k, column), value in zip(arm.free.tolist(), values.tolist(), strict=True):
        actor.set_keys(f"{actor.skeleton.names[arm.joints[k]]}.{CHANNELS[column]}", [frame], value, scene.spline)


def pierced_frames(
    scene: Scene, actor: Actor, covering: Covering, arm: Arm, first: float, last: float
) -> dict[float, int]:
    """Number of faces of the body that an arm passes through, by frame: all frames between two, and these."""
    from warpjld.grasp.arm_clearance import pierced_faces

    whole = np.arange(math.floor(first) + 1, math.ceil(last), dtype=float)
    frames = np.array([first, *whole, last])
    if len(frames) > _LOOKS:
        frames = np.linspace(first, last, _LOOKS)
    skins = covering.deform(stage(actor, frames, scene.rate))
    return {f: len(pierced_faces(covering, arm, skin)) for f, skin in zip(frames.tolist(), skins, strict=True)}


def clear_way(
    scene: Scene, actor: Actor, arm: Arm, first: float, last: float, pierced: dict[float, int]
) -> dict[float, int]:
    """Set keys between two frames so that the arm passes around the body, or through the least of it.

    Args:
        scene: The scene.
        actor: The body.
        arm: Its arm, with keys at both frames.
        first: The earlier frame.
        last: The later frame.
        pierced: Faces that are passed through, by frame, as of ``pierced_frames``.

    Returns:
        The same with the keys that were set.
    """
    if not (least := _on_the_way(pierced, first, last)):
        return pierced
    tracks = actor.motion.tracks
    before = best = deepcopy(tracks)
    out = pierced
    for keys in ({}, *_keys_around(scene, actor, arm, first, last)):
        _restore(tracks, before)
        for frame, values in keys.items():
            key_arm(scene, actor, arm, frame, values)
        now = pierced_frames(scene, actor, cover(actor), arm, first, last) if keys else pierced
        now = _nudged(scene, actor, arm, first, last, now, keys.keys())
        if (amount := _on_the_way(now, first, last)) < least:
            least, out, best = amount, now, deepcopy(tracks)
        if not least:
            break
    _restore(tracks, best)
    return out


def _on_the_way(pierced: dict[float, int], first: float, last: float) -> int:
    """Faces that are passed through at frames between two, in all."""
    return sum(count for frame, count in pierced.items() if frame not in (first, last))


def _restore(tracks: dict[str, Track], kept: dict[str, Track]) -> None:
    tracks.clear()
    tracks.update(deepcopy(kept))


def _nudged(
    scene: Scene, actor: Actor, arm: Arm, first: float, last: float, pierced: dict[float, int], keys: Collection[float]
) -> dict[float, int]:
    """Keys at the worst frames on the way, one after another, each the nearest posture outside the body.

    Returns:
        Faces that are then passed through, by frame.
    """
    from warpjld.grasp.arm_clearance import ArmClearance
    from warpjld.skeleton.reach import clear

    keyed = {first, last, *keys}
    for k in range(_NUDGES):
        way = [frame for frame, count in pierced.items() if count and frame not in keyed]
        if not way:
            break
        worst = max(way, key=lambda frame: pierced[frame])
        poses, angles = posture(scene, actor, worst)
        depths = ArmClearance(cover(actor), arm, poses).wider((1 + k) * _MARGIN)
        key_arm(scene, actor, arm, worst, clear(arm, angles[0], poses, arm.values(angles[0]), depths))
        keyed.add(worst)
        pierced = pierced_frames(scene, actor, cover(actor), arm, first, last)
    return pierced


def _keys_around(
    scene: Scene, actor: Actor, arm: Arm, first: float, last: float
) -> Iterator[dict[float, NDArray[np.float64]]]:
    """Sets of keys by which the arm may go around the body: frames → its angles [rad], shape (n,).

    The arm comes to its goal from further outside the body; and to there straight, or by a posture on the way.
    """
    from warpjld.grasp.arm_clearance import ArmClearance
    from warpjld.skeleton.arm_way import postures_between
    from warpjld.skeleton.reach import clear

    poses, angles = posture(scene, actor, last)
    start, end = arm.values(posture(scene, actor, first)[1][0]), arm.values(angles[0])
    depths = ArmClearance(cover(actor), arm, poses)
    outside = clear(arm, angles[0], poses, end, depths.wider(_OUTSIDE))
    before = _whole(first + _APPROACH * (last - first), first, last)
    yield {before: outside}
    for values in postures_between(arm, angles[0], poses, start, outside, depths.wider(_MARGIN), _TRIED):
        there, back = float(np.linalg.norm(values - start)), float(np.linalg.norm(outside - values))
        yield {
            _whole(first + (before - first) * there / max(there + back, 1e-9), first, before): values,
            before: outside,
        }


def _whole(frame: float, first: float, last: float) -> float:
    """The nearest whole frame, where there is one between two others."""
    return float(round(frame)) if first + 0.5 < round(frame) < last - 0.5 else frame
