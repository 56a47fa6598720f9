"""Reader of hand poses of the MANO family: 45, 48 or 51 numbers a frame, and hands of SMPL-H and SMPL-X poses."""

from __future__ import annotations

import re
from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.files.json_pieces import JSON_LISTS
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.mano_rest import MANO_JOINTS
from warpjld.motion.mano_track import ManoTrack
from warpjld.motion.stated_times import stated_times, time_fields

__all__ = ["is_mano", "mano_hands"]

_POSE = ("hand_pose", "mano_pose", "pose", "poses", "fullpose", "full_pose", "theta", "")
_ORIENT = ("global_orient", "root_orient", "orient")
_PLACE = ("transl", "trans", "translation")
_HANDS = {side: (f"{side}_hand_pose", f"{side}_hand", f"{side[0]}hand_pose") for side in ("left", "right")}
_FRAMES = ("frames", "data", "results")
_SIDE = ("side", "handedness", "hand", "is_right", "is_rhand", "right")
_WIDTHS = (45, 48, 51)  # axis-angle numbers: fifteen joints; with the wrist; with its place
_BODIES = {156: (66, "SMPL-H"), 165: (75, "SMPL-X")}
"""Width of a body's pose → index of its left hand's first number (the right hand follows), and the model's name."""
_MOST_TURN = 4.0 * np.pi
"""Largest plausible component: axis-angle vectors have lengths up to π, sums with a mean a little more; degrees soon
exceed this."""
_JOINT = re.compile(r"(index|middle|pinky|little|ring|thumb)[ _.-]?(?:finger)?[ _.-]?([123])$", re.IGNORECASE)

Fields = Mapping[str, Any]


def is_mano(fields: Any) -> bool:
    """Whether fields are MANO's, by their names, or for a bare array by its width."""
    found = _gathered(fields)
    if any(key in found for names in _HANDS.values() for key in names) or "pose_hand" in found:
        return True
    if any(isinstance(found.get(side), Mapping) and is_mano(found[side]) for side in _HANDS):
        return True
    key = next((key for key in _POSE if key in found), None)
    if key is None:
        return False
    try:
        array = np.asarray(found[key], dtype=np.float64)
    except (TypeError, ValueError):
        return key in ("hand_pose", "mano_pose")
    return key != "" or _width(array) in (*_WIDTHS, *_BODIES)


def mano_hands(
    fields: Any, rate: float | None = None, flat_hand_mean: bool | None = None, *, where: str = "the file"
) -> HandRecording:
    """Hands of MANO-family parameters.

    Widths: 45, fifteen joints; 48, with the wrist before them; 51, with the wrist's translation after them; 156 and
    165, bodies of SMPL-H and SMPL-X, of which only the hands are read. Rotations are axis-angle vectors [rad], or 3 × 3
    matrices where a joint has nine numbers. ``global_orient`` and ``transl`` may accompany 45 numbers. Both hands may
    be given, as ``left_hand_pose`` and ``right_hand_pose`` or inside ``left`` and ``right``.

    Joints are in MANO's order (index, middle, pinky, ring, thumb) unless ``joint_order`` names another. Whether zero
    rotations mean the flat hand or MANO's mean pose must be stated, by ``flat_hand_mean`` in the file or here. The mean
    pose is part of the licensed model: it is added if the file contains it as ``hands_mean``.

    Args:
        fields: Arrays by name, or a list of frames with such fields; "" is the name of the array of an unnamed file.
        rate: Frames a second if the file does not state it.
        flat_hand_mean: Meaning of zero rotations if the file does not state it.
        where: Name of the file's content in messages.

    Raises:
        InputError: Other widths, non-finite numbers, an unknown order, or ``flat_hand_mean`` stated nowhere.
    """
    found = _gathered(fields)
    notes: list[str] = []
    warnings: list[str] = []
    flat = _flat(found, flat_hand_mean, warnings)
    parts = _parts(found, warnings)
    count = len(next(iter(parts.values()))[1])
    frames = [time_fields(frame) for frame in fields] if isinstance(fields, JSON_LISTS) else [{}] * count
    listed = next((found[key] for key in _FRAMES if isinstance(found.get(key), JSON_LISTS)), None)
    frames = frames if listed is None else [time_fields(frame) for frame in listed]
    # convert only rows of numbers to lists: as a list, the poses of a long recording would need most of the memory
    rows = {name: value for name, value in found.items() if not (isinstance(value, np.ndarray) and value.ndim > 1)}
    about = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in rows.items()}
    times, rate = stated_times(about, frames if len(frames) == count else [{}] * count, rate, notes)
    order, said = _order(found)
    if not said:
        notes.append("joints in MANO's own order (index, middle, pinky, ring, thumb): the file states none")
    in_rig = str(_plain(found.get("frame", ""))) == "rig"
    hands = []
    for side, (own, pose) in parts.items():
        if len(pose) != count:
            raise InputError(f"{where} has {count} frames of one hand and {len(pose)} of the other")
        orient, place = _rotations(own, _ORIENT, count), _vectors(own, _PLACE, count)
        if pose.shape[1] > 45:
            orient = pose[:, :3] if orient is None else orient
        if pose.shape[1] == 51:
            place = pose[:, 48:] if place is None else place
            notes.append("51 numbers a frame are read as wrist (3), joints (45), translation (3)")
        joints = (pose[:, 3:48] if pose.shape[1] > 45 else pose).reshape(count, 15, 3)
        if not flat:
            joints = joints + _mean(found | dict(own), side)
        hands.append(ManoTrack(side, times, joints[:, order], orient, place, in_rig))
    return HandRecording(tuple(hands), rate, tuple(dict.fromkeys(notes)), tuple(warnings))


def _gathered(fields: Any) -> dict[str, Any]:
    """Fields over all frames: those of a list of frames are stacked, a bare list is one array."""
    if isinstance(fields, Mapping):
        listed = next((key for key in _FRAMES if isinstance(fields.get(key), JSON_LISTS)), "")
        if listed and fields[listed] and isinstance(fields[listed][0], Mapping):
            return {key: value for key, value in fields.items() if key != listed} | _gathered(fields[listed])
        return dict(fields)
    if not isinstance(fields, JSON_LISTS) or not fields:
        return {}
    columns: dict[str, list[Any]] = {key: [] for key in fields[0]} if isinstance(fields[0], Mapping) else {}
    for frame in fields:
        if not isinstance(frame, Mapping):
            return {"": fields}
        for key, column in columns.items():
            column.append(_packed(frame.get(key)))
    out: dict[str, Any] = {}
    for key, values in columns.items():
        if all(isinstance(value, Mapping) for value in values):
            out[key] = _gathered(values)
        elif all(value == values[0] for value in values) and not isinstance(values[0], (list, array)):
            out[key] = values[0]
        else:
            out[key] = values
    return out


def _packed(value: Any) -> Any:
    """A value with its rows of numbers as arrays, which take a quarter of the memory."""
    if isinstance(value, Mapping):
        return {key: _packed(inner) for key, inner in value.items()}
    if not isinstance(value, list) or not value:
        return value
    if all(type(one) in (int, float) for one in value):
        return array("d", value)
    return [_packed(one) for one in value]


def _parts(found: Fields, warnings: list[str]) -> dict[str | None, tuple[Fields, NDArray[np.float64]]]:
    """Per hand its own fields and its numbers, shape (F, 45), (F, 48) or (F, 51)."""
    parts: dict[str | None, tuple[Fields, NDArray[np.float64]]] = {}
    for side, names in _HANDS.items():
        if isinstance(found.get(side), Mapping):
            key = next((key for key in _POSE if key in found[side]), None)
            if key is not None:
                parts[side] = (found[side], _pose(found[side][key], key))
        elif key := next((key for key in names if key in found and found[key] is not None), None):
            parts[side] = ({}, _pose(found[key], key))
    if parts:
        return parts
    if "pose_hand" in found:  # AMASS: both hands, the left first
        both = _numbers(found["pose_hand"], "pose_hand")
        if both.shape[-1] != 90:
            raise InputError(f"'pose_hand': want 90 numbers a frame, got {both.shape}")
        return {side: ({}, _pose(half, "pose_hand")) for side, half in zip(_HANDS, np.split(both, 2, -1), strict=True)}
    key = next(key for key in _POSE if key in found)
    array = _numbers(found[key], key)
    if _width(array) in _BODIES:
        start, model = _BODIES[_width(array) or 0]
        warnings.append(f"a body's pose ({model}): only its hands are followed")
        body = array.reshape(-1, _width(array) or 0)
        return {side: ({}, body[:, start + 45 * k : start + 45 * (k + 1)]) for k, side in enumerate(_HANDS)}
    return {_side(found): (found, _pose(array, key))}


def _pose(values: Any, key: str) -> NDArray[np.float64]:
    array = _numbers(values, key)
    if array.shape[-2:] == (3, 3) and array.ndim in (4, 5) and array.shape[-3] in (15, 16):
        turns = Rotation.from_matrix(array.reshape(-1, 3, 3)).as_rotvec()
        array = turns.reshape(-1, 3 * array.shape[-3])
    width = _width(array)
    if width not in _WIDTHS:
        raise InputError(
            f"'{key}': want 45, 48 or 51 numbers a frame (axis-angle; MANO's principal components are not read), "
            f"got shape {array.shape}"
        )
    array = array.reshape(-1, width)
    if (largest := np.abs(array[:, :48]).max()) > _MOST_TURN:
        raise InputError(f"'{key}': {largest:.4g} is no rotation in radians (degrees?)")
    return array


def _width(array: NDArray[np.float64]) -> int | None:
    """Numbers per frame of an array of shape (n,), (F, n), (J, 3) or (F, J, 3)."""
    if array.ndim >= 2 and array.shape[-1] == 3 and 3 * array.shape[-2] in (*_WIDTHS, *_BODIES):
        return 3 * array.shape[-2]
    return array.shape[-1] if array.ndim in (1, 2, 3) and array.size else None


def _numbers(values: Any, key: str) -> NDArray[np.float64]:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"'{key}': want numbers, as many in every frame") from None
    if not array.size or not array.ndim:
        raise InputError(f"'{key}': want rows of numbers, got {'one' if array.size else 'none'}")
    if not np.isfinite(array).all():
        raise InputError(f"'{key}': not finite in frame {np.argwhere(~np.isfinite(array))[0][0]}")
    return array


def _rotations(own: Fields, names: tuple[str, ...], count: int) -> NDArray[np.float64] | None:
    key = next((key for key in names if key in own), None)
    if key is None:
        return None
    array = _numbers(own[key], key)
    if array.shape[-2:] == (3, 3) and array.size == 9 * count:
        return np.asarray(Rotation.from_matrix(array.reshape(-1, 3, 3)).as_rotvec())
    return _vectors(own, names, count)


def _vectors(own: Fields, names: tuple[str, ...], count: int) -> NDArray[np.float64] | None:
    key = next((key for key in names if key in own), None)
    if key is None:
        return None
    array = _numbers(own[key], key)
    if array.size != 3 * count or array.shape[-1] != 3:
        raise InputError(f"'{key}': want 3 numbers in each of {count} frames, got shape {array.shape}")
    return array.reshape(count, 3)


def _flat(found: Fields, given: bool | None, warnings: list[str]) -> bool:
    stated = _plain(found.get("flat_hand_mean"))
    if stated is not None and not isinstance(stated, (bool, int, float)):
        raise InputError(f"flat_hand_mean: want true or false, got '{stated}'")
    if stated is None and given is None:
        raise InputError(
            "does not say whether no rotation means the flat hand or MANO's mean pose: state flat_hand_mean, "
            "in the file (a field flat_hand_mean, true or false) or as an option"
        )
    if stated is not None and given is not None and bool(stated) != given:
        warnings.append(f"the file states flat_hand_mean {bool(stated)}: read as {given}, as requested")
    return bool(stated) if given is None else given


def _mean(found: Fields, side: str | None) -> NDArray[np.float64]:
    """MANO's mean pose, shape (15, 3)."""
    names = ["hands_mean", "hand_mean", "pose_mean"]
    if side is not None:
        names = [f"hands_mean{side[0]}", f"{side}_hand_mean", *names]
    key = next((key for key in names if key in found), None)
    if key is None:
        raise InputError(
            "its rotations count from MANO's mean pose (flat_hand_mean false), which is part of the licensed model: "
            "add its 45 numbers as 'hands_mean', or write rotations from the flat hand"
        )
    array = _numbers(found[key], key)
    if array.size != 45:
        raise InputError(f"'{key}': want 45 numbers, got {array.size}")
    return array.reshape(15, 3)


def _order(found: Fields) -> tuple[list[int], bool]:
    """Index in the file of each of MANO's fifteen joints, and whether the file states the order."""
    names = next((found[key] for key in ("joint_order", "joint_names", "joints_order") if key in found), None)
    if names is None:
        return list(range(15)), False
    listed = [str(name) for name in _listed(names)]
    keys = [f"{m[1].lower().replace('little', 'pinky')}{m[2]}" for name in listed if (m := _JOINT.search(name))]
    if sorted(keys) != sorted(MANO_JOINTS):
        raise InputError(
            f"joint_order: want the fifteen joints {', '.join(MANO_JOINTS[:4])}, …, got {', '.join(listed)}"
        )
    return [keys.index(name) for name in MANO_JOINTS], True


def _side(found: Fields) -> str | None:
    for key in _SIDE:
        if key not in found or isinstance(found[key], Mapping):
            continue
        values = {str(value).lower() for value in _listed(found[key])}
        if key in ("is_right", "is_rhand", "right"):
            values = {{"true": "right", "1": "right", "1.0": "right"}.get(value, "left") for value in values}
        values = {{"l": "left", "r": "right"}.get(value, value) for value in values}
        if len(values) > 1:
            raise InputError(f"'{key}': frames of both hands in one sequence; give each its own")
        if not values <= set(_HANDS):
            raise InputError(f"'{key}': want left or right, got '{values.pop()}'")
        return values.pop() if values else None
    return None


def _plain(value: Any) -> Any:
    """The element of an array of one; other values unchanged."""
    listed = _listed(value)
    return listed[0] if len(listed) == 1 else value


def _listed(values: Any) -> list[Any]:
    """The elements of an array of any shape, a list, or a single value, as a list."""
    try:
        return list(np.asarray(values).ravel().tolist())
    except ValueError:  # a ragged list
        return [str(values)]
