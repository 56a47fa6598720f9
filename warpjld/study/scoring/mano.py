"""Reader of recordings of MANO hands with objects, as in GraspXL (Zhang et al. 2024): a dictionary in an ``.npy`` file.

A hand, ``right_hand`` or ``left_hand``, has for every frame ``trans`` [m], ``rot`` and ``pose`` (axis-angle, fifteen
joints in MANO's order); every other entry with ``trans`` and ``rot`` is the object, by its name. ``trans`` is read as
the wrist's position. MANO's own translation differs from it by the wrist's position in the rest hand, which is part of
the licensed model; a field ``wrist`` [m] of the hand is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.grasp.objects import Places
from warpjld.motion.mano import mano_hands
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.reading_grasps import GraspReading

__all__ = ["is_mano_grasp", "mano_grasps"]

Array = NDArray[np.float64]

_HANDS = {"right_hand": "right", "left_hand": "left"}
_RATE = 30.0  # nominal frame rate [1/s]; frames are used one by one, so it has no effect


def is_mano_grasp(content: Any) -> bool:
    """Whether a file's content is in this format."""
    return isinstance(content, Mapping) and any(isinstance(content.get(key), Mapping) for key in _HANDS)


def mano_grasps(content: Mapping[str, Any], name: str, how: GraspReading) -> list[GivenGrasp]:
    """Grasps of a recording: the last frame, or every frame.

    Raises:
        InputError: No hand of the rig's side, no object, frames that differ in number, or what ``mano_hands`` refuses.
    """
    rig = how.hand("")
    side = next(name for name in ("left", "right") if f"{name}.wrist" in rig.skeleton.names)
    hand = content.get(f"{side}_hand")
    if not isinstance(hand, Mapping):
        raise InputError(f"has no {side}_hand, but the rig is a {side} hand")
    things = [key for key, value in content.items() if key not in _HANDS and isinstance(value, Mapping)]
    if len(things) != 1:
        raise InputError(f"want one object beside the hand, got {', '.join(things) or 'none'}")
    thing = content[things[0]]
    trans, turn = _vectors(hand, "trans"), _vectors(hand, "rot")
    count = len(trans)
    if "wrist" in hand:
        trans = trans + _vectors(hand, "wrist")
    where, facing = _vectors(thing, "trans"), _vectors(thing, "rot")
    if {count} != {len(turn), len(where), len(facing)}:
        raise InputError(f"{things[0]}: want as many frames as the hand has, {count}")
    fields = {"pose": hand.get("pose"), "global_orient": turn, "transl": trans, "side": side, "frame": "rig"}
    fields |= {key: hand[key] for key in ("flat_hand_mean", "hands_mean", "joint_order") if key in hand}
    (track,) = mano_hands(fields, _RATE, how.flat_hand_mean, where="the recording").hands
    if len(track.times) != count:
        raise InputError(f"pose: want {count} frames, got {len(track.times)}")
    turns = track.turns(rig.skeleton).part(slice(0, count))
    quaternions = Rotation.from_rotvec(facing).as_quat()
    wanted = range(count) if how.frames == "all" else [count - 1]
    remark = f"frame {count - 1} of {count}, the last" if count > 1 and how.frames != "all" else ""
    return [
        GivenGrasp(
            f"{name}#{k}" if count > 1 else name,
            things[0],
            turns.displacement[k],
            turns.root[k],
            turns=turns.local[k],
            place=Places.of(where[k], quaternions[k]),
            message=remark,
        )
        for k in wanted
    ]


def _vectors(fields: Mapping[str, Any], key: str) -> Array:
    try:
        array = np.atleast_2d(np.asarray(fields.get(key), dtype=np.float64))
    except (TypeError, ValueError):
        array = np.zeros((0, 0))
    if array.ndim != 2 or array.shape[1] != 3 or not len(array) or not np.isfinite(array).all():
        raise InputError(f"'{key}': want three finite numbers a frame")
    return array
