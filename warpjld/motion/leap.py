"""Recordings of a Leap Motion Controller (leapjs-playback): positions of a tracked hand's joints, millimetres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.hand_track import HandTrack

__all__ = ["leap_track"]

_DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_THUMB = {"mcpPosition": "base", "pipPosition": "knuckle2", "dipPosition": "knuckle3", "tipPosition": "tip"}
_FINGER = {"carpPosition": "carpometacarpal"} | _THUMB
_NEEDED = tuple(_THUMB)


def leap_track(content: Mapping[str, Any]) -> tuple[HandTrack, float]:
    """The first hand of a recording, in either of its formats: objects (0.1, 1) or packed arrays (2).

    The controller calls the joint after the metacarpal mcp; a thumb's metacarpal has no length there, so that its mcp
    is the thumb's base. Frames where the hand was lost are left out: they are interpolated.

    Returns:
        The recording, and its mean frames a second.

    Raises:
        InputError: No frame holds a whole hand, or a frame is not as the format wants it.
    """
    try:
        frames = _unpacked(content["frames"])
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"packed frames do not fit the fields their first row lists ({error})") from error
    times: list[float] = []
    places: list[dict[str, list[float]]] = []
    hand_id = side = None
    for number, frame in enumerate(frames):
        try:
            hands = {hand["id"]: hand for hand in frame.get("hands", ())}
            if hand_id is None and hands:
                hand_id, side = next((key, str(hand["type"])) for key, hand in hands.items())
            fingers = [p for p in frame.get("pointables", ()) if p["handId"] == hand_id and not p.get("tool")]
            if hand_id not in hands or len(fingers) != 5:
                continue
            fingers.sort(key=lambda p: p.get("type", p["id"]))
            time, place = float(frame["timestamp"]) * 1e-6, _joints(fingers)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"frame {number}: not a Leap Motion frame ({error})") from error
        if not math.isfinite(time) or (times and time <= times[-1]):
            raise InputError(f"frame {number}: its timestamp is not a time after the one before")
        times.append(time)
        places.append(place)
    if side not in ("left", "right") or not times:
        raise InputError("no frame holds a hand with five fingers")
    joints = set.intersection(*(set(place) for place in places))
    points = {joint: _coordinates(joint, [place[joint] for place in places]) for joint in sorted(joints)}
    rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 1.0
    return HandTrack(str(side), np.array(times) - times[0], points), round(rate, 1)


def _coordinates(joint: str, rows: list[list[float]]) -> NDArray[np.float64]:
    try:
        array = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (len(rows), 3) or not np.isfinite(array).all():
        raise InputError(f"'{joint}' wants three finite coordinates in every frame")
    return array


def _joints(fingers: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    out: dict[str, list[float]] = {}
    for digit, finger in zip(_DIGITS, fingers, strict=True):
        for field, joint in (_THUMB if digit == "thumb" else _FINGER).items():
            if field in finger:
                out[f"{digit}.{joint}"] = finger[field]
            elif field in _NEEDED:
                raise KeyError(f"{digit} without {field}")
    return out


def _unpacked(frames: Sequence[Any]) -> list[Mapping[str, Any]]:
    """Frames as objects; in format 2 the first entry lists the fields, the others are rows."""
    if not frames:
        raise InputError("no frames")
    if isinstance(frames[0], Mapping):
        return list(frames)
    fields = frames[0]
    out: list[Mapping[str, Any]] = []
    for number, row in enumerate(frames[1:], start=1):
        if not isinstance(row, Sequence) or len(row) != len(fields):
            raise InputError(f"frame {number}: want {len(fields)} entries, as the first line lists them")
        frame: dict[str, Any] = {}
        for field, value in zip(fields, row, strict=True):
            if isinstance(field, str):
                frame[field] = value
                continue
            for name, inner in field.items():
                many = isinstance(inner[0], list)
                frame[name] = [dict(zip(inner[0], v, strict=True)) for v in value] if many else value
        out.append(frame)
    return out
