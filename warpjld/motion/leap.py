"""Reader of Leap Motion Controller recordings (leapjs-playback): joint positions of tracked hands, millimetres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.gaps import bridged
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.hand_track import HandTrack

__all__ = ["is_leap", "leap_hands"]

_DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_THUMB = {"mcpPosition": "base", "pipPosition": "knuckle2", "dipPosition": "knuckle3", "tipPosition": "tip"}
_FINGER = {"carpPosition": "carpometacarpal"} | _THUMB
_NEEDED = tuple(_THUMB)


def is_leap(content: Any) -> bool:
    """Whether JSON content holds Leap Motion frames: objects with hands or pointables, or packed rows of fields."""
    frames = content.get("frames") if isinstance(content, Mapping) else None
    if not isinstance(frames, list):
        return False
    packed = bool(frames) and isinstance(frames[0], list) and any(isinstance(field, str) for field in frames[0])
    return not frames or packed or any("pointables" in f for f in frames if isinstance(f, Mapping))


def leap_hands(content: Mapping[str, Any]) -> HandRecording:
    """The hands of a recording, by side, in either of its formats: objects (0.1, 1) or packed arrays (2).

    The controller calls the joint after the metacarpal mcp; a thumb's metacarpal has no length there, so that its mcp
    is the thumb's base. A hand that is lost and found again gets another id, so hands are identified by their side.
    Frames without a hand are left out and interpolated later.

    Raises:
        InputError: No frame holds a whole hand, or a frame does not follow the format.
    """
    try:
        frames = _unpacked(content["frames"])
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"packed frames do not fit the fields their first row lists ({error})") from error
    times: dict[str | None, list[float]] = {}
    places: dict[str | None, list[dict[str, list[float]]]] = {}
    numbers: dict[str | None, list[int]] = {}
    doubled, began, last = 0, None, -math.inf
    for number, frame in enumerate(frames):
        try:
            time, seen = float(frame["timestamp"]) * 1e-6, _whole_hands(frame)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"frame {number}: not a Leap Motion frame ({error})") from error
        if not math.isfinite(time) or time <= last:
            raise InputError(f"frame {number}: its timestamp is not a time after the one before")
        last = time
        for side, place in seen:
            if numbers.get(side, [-1])[-1] == number:
                doubled += 1
                continue
            began = time if began is None else began
            times.setdefault(side, []).append(time - began)
            places.setdefault(side, []).append(place)
            numbers.setdefault(side, []).append(number)
    if not times:
        raise InputError("no frame holds a hand with five fingers")
    if None in times and len(times) > 1:
        raise InputError(f"frame {numbers[None][0]}: a hand without a type, others say left or right")
    hands: list[HandTrack] = []
    notes: list[str] = []
    for side, rows in places.items():
        joints = set.intersection(*(set(place) for place in rows))
        points = {joint: _coordinates(joint, [place[joint] for place in rows]) for joint in sorted(joints)}
        labels = tuple(f"frame {number}" for number in numbers[side])
        hands.append(HandTrack(side, np.array(times[side]), points, labels=labels))
        notes += bridged(f"{side or 'the'} hand", numbers[side])
    if doubled:
        notes.append(f"a second hand of the same side was left out of {doubled} frames")
    longest = max(times.values(), key=len)
    rate = (len(longest) - 1) / (longest[-1] - longest[0]) if len(longest) > 1 else 1.0
    return HandRecording(tuple(hands), round(rate, 1), tuple(notes))


def _whole_hands(frame: Mapping[str, Any]) -> list[tuple[str | None, dict[str, list[float]]]]:
    """Side and joint positions of the hands of a frame that have all five fingers."""
    found: list[tuple[str | None, dict[str, list[float]]]] = []
    for hand in frame.get("hands", ()):
        fingers = [p for p in frame.get("pointables", ()) if p["handId"] == hand["id"] and not p.get("tool")]
        if len(fingers) == 5:
            side = str(hand["type"]).lower() if "type" in hand else None
            if side not in ("left", "right", None):
                raise ValueError(f"a hand of type '{side}'")
            found.append((side, _joints(sorted(fingers, key=lambda p: p.get("type", p["id"])))))
    return found


def _coordinates(joint: str, rows: list[list[float]]) -> NDArray[np.float64]:
    try:
        array = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (len(rows), 3) or not np.isfinite(array).all():
        raise InputError(f"'{joint}' needs three finite coordinates in every frame")
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
    """Frames as objects; in format 2 the first entry lists the fields, the others are rows of values."""
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
