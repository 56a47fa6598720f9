"""Reader of MediaPipe's 21 hand landmarks, as written by its tasks, its older solutions and scripts: JSON and NPZ.

Axes are the camera's: x to the right, y down, z away from it. World landmarks are in metres from the hand's centre;
image landmarks have x and y as fractions of the image's width and height, and z on the scale of x.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.json_pieces import JSON_LISTS
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.hands_by_side import hands_by_side
from warpjld.motion.seen_hands import SeenHand, recording_of
from warpjld.motion.stated_times import stated_times, time_fields

__all__ = ["MEDIAPIPE_JOINTS", "is_mediapipe", "mediapipe_arrays", "mediapipe_hands"]

MEDIAPIPE_JOINTS = (
    "wrist",
    *(
        f"{digit}.{joint}"
        for digit in ("thumb", "index", "middle", "ring", "pinky")
        for joint in ("base", "knuckle2", "knuckle3", "tip")
    ),
)
"""Landmark → canonical joint without the side."""

_COUNT = len(MEDIAPIPE_JOINTS)
_STEMS = ("landmarks", "hand_landmarks", "handLandmarks", "multi_hand_landmarks", "multiHandLandmarks", "keypoints")
_WORLD = (
    "world_landmarks",
    "worldLandmarks",
    "hand_world_landmarks",
    "handWorldLandmarks",
    "multi_hand_world_landmarks",
    "multiHandWorldLandmarks",
    "keypoints3D",
)
_SIDES = ("handedness", "handednesses", "multi_handedness", "multiHandedness", "side")
_NAMES = ("category_name", "categoryName", "label", "display_name", "displayName")
_CONFIDENCE = ("confidence", "confidences", "score", "scores", "visibility", "presence")
_FRAMES = ("frames", "results", "data")
_ALL_SURE = np.ones(_COUNT)
"""Confidence of hands without one; shared to save memory."""


def is_mediapipe(content: Any) -> bool:
    """Whether JSON content holds hand landmarks: frames of them, or a field with one of MediaPipe's names."""
    if isinstance(content, Mapping) and any(key in content for key in _WORLD + _STEMS):
        return True
    frames = _frames(content)
    if any(hands_by_side(frame) for frame in (frames or [content])):
        return True
    first = next((frame for frame in frames if frame), None)
    first = first[0] if isinstance(first, list) and first and isinstance(first[0], Mapping) else first
    if isinstance(first, Mapping):
        return "hands" in first or any(key in first for key in _WORLD + _STEMS)
    try:
        return first is not None and np.shape(first) in ((_COUNT, 3), (1, _COUNT, 3), (2, _COUNT, 3))
    except ValueError:
        return False


def mediapipe_hands(content: Any, rate: float | None = None) -> HandRecording:
    """Hands of a JSON recording: a list of frames, or an object with one in ``frames``, or a single frame.

    A frame is an object with ``landmarks`` and ``world_landmarks`` (or the names of the tasks and solutions) of one or
    several hands, ``handedness``, ``confidence`` and a time; or an object with a hand per side, as the holistic
    landmarker writes them; or a list of hands; or 21 points. World landmarks are preferred.

    Args:
        content: Content of the file.
        rate: Frames a second if the file does not state it.

    Raises:
        InputError: No hand in any frame, or landmarks that are not 21 points, with the frame's number.
    """
    frames = _frames(content)
    timed = [time_fields(frame) for frame in frames]
    return _hands(content if isinstance(content, Mapping) else {}, frames, timed, rate)


def _hands(
    about: Mapping[str, Any], frames: Sequence[Any], timed: Sequence[Mapping[str, Any]], rate: float | None
) -> HandRecording:
    """Hands of frames, whose times are in ``timed`` or ``about``."""
    notes: list[str] = []
    times, rate = stated_times(about, timed, rate, notes)
    seen: list[list[SeenHand]] = []
    for number, frame in enumerate(frames):
        try:
            seen.append(_hands_of(frame, about) if frame is not None else [])
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"frame {number}: not hands of 21 landmarks ({error})") from error
    size = _image_size(about)
    if _in_image(seen):
        if size is None:
            notes.append(
                "landmarks in parts of an image whose size the file does not state (image_size): assumed square"
            )
        else:
            scale = np.array([size[0], size[1], size[0]])
            for hands in seen:
                hands[:] = [replace(hand, points=hand.points * scale) for hand in hands]
    return recording_of(seen, MEDIAPIPE_JOINTS, times, rate, notes)


def mediapipe_arrays(arrays: Mapping[str, NDArray[Any]], rate: float | None = None) -> HandRecording:
    """Hands of an NPZ or NPY file: ``landmarks`` or ``world_landmarks``, shape (F, 21, 3) or (F, hands, 21, 3).

    Optional arrays: ``confidence`` of shape (F,), (F, hands), (F, 21) or (F, hands, 21), ``handedness`` (one, one per
    hand, or one per frame and hand), ``timestamps`` or ``fps``, and ``image_size``. Frames with NaN are gaps.

    Raises:
        InputError: Arrays of other shapes.
    """
    key = next(key for key in (*_WORLD, *_STEMS, "") if key in arrays)
    points = np.asarray(arrays[key])
    points = points[:, None] if points.ndim == 3 else points
    if points.ndim != 4 or points.shape[2:] != (_COUNT, 3) or points.dtype.kind not in "fiu":
        raise InputError(
            f"'{key}': want numbers of shape (frames, 21, 3) or (frames, hands, 21, 3), got {arrays[key].shape}"
        )
    count, hands = points.shape[:2]
    about = {n: array.tolist() for n, array in arrays.items() if n not in (key, *_CONFIDENCE, *_SIDES)}
    fields: dict[str, NDArray[Any]] = {key or "landmarks": points}
    for name in (*_CONFIDENCE, *_SIDES):
        if name not in arrays:
            continue
        array = np.asarray(arrays[name])
        if array.dtype.kind not in "fiuUS":
            raise InputError(f"'{name}': want numbers or text")
        if array.shape[:1] == (count,) and array.shape not in ((hands,), ()):
            fields[name] = array
        elif name in _SIDES and array.shape in ((), (1,), (hands,)):
            fields[name] = np.broadcast_to(array, (count, hands))
        elif name in _CONFIDENCE and array.shape == (count,):
            fields[name] = array
        else:
            raise InputError(f"'{name}': shape {array.shape} fits neither {count} frames nor {hands} hands")
    return _hands(about, _ArrayFrames(fields, count), [{}] * count, rate)


class _ArrayFrames(Sequence[Any]):
    """Frames of arrays as JSON-like objects, created on demand, since as objects they take ten times the memory.

    Args:
        fields: Arrays (F, …) by name.
        count: Count F of frames.
    """

    def __init__(self, fields: Mapping[str, Any], count: int) -> None:
        self._fields, self._count = fields, count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frame: Any) -> Any:
        if not 0 <= frame < self._count:
            raise IndexError
        return {name: array[frame].tolist() for name, array in self._fields.items()}


class _Named(Sequence[Any]):
    """Frames as objects with one field, created on demand."""

    def __init__(self, key: str, items: Sequence[Any]) -> None:
        self._key, self._items = key, items

    def __len__(self) -> int:
        return len(self._items)

    def __getitem__(self, frame: Any) -> Any:
        return {self._key: self._items[frame]}


def _frames(content: Any) -> Sequence[Any]:
    """Frames of a recording; a single result is one frame."""
    if isinstance(content, Mapping):
        listed = next((content[key] for key in _FRAMES if isinstance(content.get(key), JSON_LISTS)), None)
        if listed is None and (key := _has(content, _WORLD) or _has(content, _STEMS)):
            try:
                many = np.shape(content[key])[1:] == (_COUNT, 3) and np.shape(content[key])[0] > 2
            except ValueError:
                many = False
            return _Named(key, content[key]) if many else [content]
        return [content] if listed is None and hands_by_side(content) else listed or []
    if isinstance(content, JSON_LISTS) and content and isinstance(content[0], (int, float)):
        return []
    if (
        isinstance(content, JSON_LISTS)
        and len(content) == _COUNT
        and not _is_hand(content[0])
        and _is_point(content[0])
    ):
        return [content]
    return content if isinstance(content, JSON_LISTS) else []


def _hands_of(frame: Any, about: Mapping[str, Any]) -> list[SeenHand]:
    """The hands of one frame."""
    if isinstance(frame, list) and frame and isinstance(frame[0], Mapping) and "x" not in frame[0]:
        frame = {"hands": frame}
    if not isinstance(frame, Mapping):
        frame = {"landmarks": frame}
    sided = hands_by_side(frame)
    frame = frame if sided is None else {"hands": sided}
    if isinstance(frame.get("hands"), list):
        each = [(k, hand) for k, one in enumerate(frame["hands"]) if one for hand in _hands_of(one, about)]
        return [replace(hand, slot=slot) for slot, hand in each]
    key = _has(frame, _WORLD) or _has(frame, _STEMS)
    given = frame[key] if key else None
    if given is None or len(given) == 0:
        return []
    listed = [given] if _is_hand(given) else list(given)
    sides = _per_hand(next((s[n] for s in (frame, about) for n in _SIDES if s.get(n) is not None), None), len(listed))
    sureness = next((frame[name] for name in _CONFIDENCE if frame.get(name) is not None), None)
    hands = []
    for slot, (hand, stated) in enumerate(zip(listed, sides, strict=True)):
        if hand is None or len(hand) == 0:
            continue
        rows = [_point(point) for point in (hand["landmark"] if isinstance(hand, Mapping) else hand)]
        if len(rows) != _COUNT:
            raise ValueError(f"{len(rows)} points")
        numbers = np.array(rows, dtype=np.float64)
        if not np.isfinite(numbers[:, :3]).all():
            continue
        sure = numbers[:, 3] if (numbers[:, 3] > 0.0).any() else _ALL_SURE  # MediaPipe's is 0 for hands
        side, score = _label(stated)
        place = numbers[:, :3] * [1.0, -1.0, -1.0]
        sure = sure if sureness is None else sure * _sureness(sureness, slot, len(listed))
        hands.append(SeenHand(place, sure, side, score, slot))
    return hands


def _in_image(seen: list[list[SeenHand]]) -> bool:
    """Whether coordinates are fractions of an image, mostly from 0 to 1; world coordinates are centred on 0."""
    inside = total = 0
    for hand in (hand for hands in seen for hand in hands):
        places = hand.points[:, :2] * [1.0, -1.0]
        inside += int(np.count_nonzero((places >= 0.0) & (places <= 1.0)))
        total += places.size
    return inside > 0.8 * total


def _sureness(given: Any, slot: int, hands: int) -> NDArray[np.float64] | float:
    """Confidence in a hand, or in each of its landmarks, between 0 and 1."""
    array = np.asarray(given, dtype=np.float64)
    if array.shape in ((hands,), (hands, _COUNT)):
        array = array[slot]
    if array.shape not in ((), (_COUNT,)):
        raise ValueError(f"a confidence of shape {array.shape}")
    return np.nan_to_num(array)


def _per_hand(stated: Any, count: int) -> list[Any]:
    if stated is None:
        return [None] * count
    if not isinstance(stated, list):
        return [stated] * count
    if count == 1:
        return [stated]
    if len(stated) != count:
        raise ValueError(f"handedness of {len(stated)}, but {count} hands")
    return stated


def _label(stated: Any) -> tuple[str | None, float]:
    """Side and confidence of a label, a category, or the most probable of several."""
    if isinstance(stated, Mapping) and "classification" in stated:
        stated = stated["classification"]
    if isinstance(stated, list):
        labels = [_label(one) for one in stated]
        return max(labels, key=lambda label: label[1]) if labels else (None, 1.0)
    score = 1.0
    if isinstance(stated, Mapping):
        score = float(stated.get("score", 1.0))
        stated = next((stated[name] for name in _NAMES if stated.get(name)), None)
    if stated is None or stated == "":
        return None, score
    side = {"l": "left", "r": "right"}.get(str(stated).lower(), str(stated).lower())
    if side not in ("left", "right"):
        raise ValueError(f"handedness '{stated}'")
    return side, score


def _point(point: Any) -> tuple[float, float, float, float]:
    if isinstance(point, Mapping):
        sure = max(float(point.get(name) or 0.0) for name in ("visibility", "presence"))
        return float(point["x"]), float(point["y"]), float(point["z"]), sure
    x, y, z = point[:3]
    return float(x), float(y), float(z), 0.0


def _is_point(value: Any) -> bool:
    return (isinstance(value, Mapping) and "x" in value) or (
        isinstance(value, Sequence) and len(value) >= 3 and isinstance(value[0], (int, float))
    )


def _is_hand(value: Any) -> bool:
    return (isinstance(value, Mapping) and "landmark" in value) or (
        isinstance(value, Sequence) and len(value) > 0 and _is_point(value[0])
    )


def _has(frame: Mapping[str, Any], names: Sequence[str]) -> str:
    return next((name for name in names if frame.get(name) is not None and len(frame[name]) > 0), "")


def _image_size(about: Mapping[str, Any]) -> tuple[float, float] | None:
    size = about.get("image_size", about.get("imageSize"))
    for wide, high in (("image_width", "image_height"), ("width", "height")):
        size = [about[wide], about[high]] if size is None and wide in about and high in about else size
    if size is None:
        return None
    try:
        width, height = (float(one) for one in (size.values() if isinstance(size, Mapping) else size))
    except (TypeError, ValueError):
        width = height = 0.0
    if not (0.0 < width < np.inf and 0.0 < height < np.inf):
        raise InputError(f"image_size: want width and height, got {size}")
    return width, height
