"""Reader of Leap Motion Controller recordings (leapjs-playback): joint positions of tracked hands, millimetres."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.json_pieces import JSON_LISTS
from warpjld.motion.gaps import bridged
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.hand_track import HandTrack

__all__ = ["is_leap", "leap_hands"]

_DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_THUMB = {"mcpPosition": "base", "pipPosition": "knuckle2", "dipPosition": "knuckle3", "tipPosition": "tip"}
_FINGER = {"carpPosition": "carpometacarpal"} | _THUMB
_NEEDED = tuple(_THUMB)
_BLOCK = 1024  # frames that are gathered before they become arrays


def is_leap(content: Any) -> bool:
    """Whether JSON content holds Leap Motion frames: objects with hands or pointables, or packed rows of fields."""
    frames = content.get("frames") if isinstance(content, Mapping) else None
    if not isinstance(frames, JSON_LISTS):
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
    times: dict[str | None, list[float]] = {}
    places: dict[str | None, _Places] = {}
    numbers: dict[str | None, list[int]] = {}
    doubled, began, last = 0, None, -math.inf
    for number, frame in enumerate(_unpacked(content["frames"])):
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
            places.setdefault(side, _Places()).add(place)
            numbers.setdefault(side, []).append(number)
    if not times:
        raise InputError("no frame holds a hand with five fingers")
    if None in times and len(times) > 1:
        raise InputError(f"frame {numbers[None][0]}: a hand without a type, others say left or right")
    hands: list[HandTrack] = []
    notes: list[str] = []
    for side, rows in places.items():
        points = rows.points()
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


class _Places:
    """Joint positions of a hand, gathered frame by frame; as lists they would take ten times the memory."""

    def __init__(self) -> None:
        self._rows: list[dict[str, list[float]]] = []
        self._blocks: list[dict[str, NDArray[np.float64] | None]] = []

    def add(self, place: dict[str, list[float]]) -> None:
        """Append a frame."""
        self._rows.append(place)
        if len(self._rows) == _BLOCK:
            self._pack()

    def points(self) -> dict[str, NDArray[np.float64]]:
        """Positions of the joints that all frames have, each of shape (K, 3).

        Raises:
            InputError: One of them has other than three finite coordinates, with its name.
        """
        if self._rows:
            self._pack()
        out = {}
        for joint in sorted(set.intersection(*(set(block) for block in self._blocks))):
            parts = [part for block in self._blocks if (part := block[joint]) is not None]
            if len(parts) < len(self._blocks):
                raise InputError(f"'{joint}' needs three finite coordinates in every frame")
            out[joint] = np.concatenate(parts)
        return out

    def _pack(self) -> None:
        joints = set.intersection(*(set(place) for place in self._rows))
        self._blocks.append({joint: _coordinates([place[joint] for place in self._rows]) for joint in joints})
        self._rows = []


def _coordinates(rows: list[list[float]]) -> NDArray[np.float64] | None:
    """Positions, shape (frames, 3); None if they are not three finite coordinates."""
    try:
        array = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.shape == (len(rows), 3) and np.isfinite(array).all() else None


def _joints(fingers: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    out: dict[str, list[float]] = {}
    for digit, finger in zip(_DIGITS, fingers, strict=True):
        for field, joint in (_THUMB if digit == "thumb" else _FINGER).items():
            if field in finger:
                out[f"{digit}.{joint}"] = finger[field]
            elif field in _NEEDED:
                raise KeyError(f"{digit} without {field}")
    return out


def _unpacked(frames: Sequence[Any]) -> Iterator[Mapping[str, Any]]:
    """Frames as objects; in format 2 the first entry lists the fields, the others are rows of values."""
    if not frames:
        raise InputError("no frames")
    if isinstance(frames[0], Mapping):
        yield from frames
        return
    fields = frames[0]
    for number, row in enumerate(frames):
        if number:
            try:
                yield _unpacked_row(number, fields, row)
            except (AttributeError, IndexError, TypeError, ValueError) as error:
                raise InputError(f"packed frames do not fit the fields their first row lists ({error})") from error


def _unpacked_row(number: int, fields: Sequence[Any], row: Any) -> Mapping[str, Any]:
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
    return frame
