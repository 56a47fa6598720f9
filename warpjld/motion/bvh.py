"""Reading BVH files: a hierarchy of offsets, then a line of channel values a frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.clip import Clip
from warpjld.rotations import multiply, rotate

__all__ = ["read_bvh"]

_AXES = "xyz"
_CHANNELS = {f"{axis}{kind}": (kind, a) for a, axis in enumerate(_AXES) for kind in ("position", "rotation")}


@dataclass
class _Joint:
    name: str
    parent: int
    line: int
    offset: NDArray[np.float64] | None = None
    channels: list[tuple[str, int]] = field(default_factory=list)


def read_bvh(path: str | Path) -> Clip:
    """Read a BVH file: any hierarchy, any order of channels. End sites become joints called ``<parent> end``.

    Position channels replace a joint's offset. Rotations apply in the order of their channels, each about an axis
    the previous ones have turned.

    Raises:
        InputError: Unreadable, or not as the format wants it, with the line.
    """
    lines = _Lines(path)
    joints = _hierarchy(lines)
    values, rate = _motion(lines, sum(len(joint.channels) for joint in joints))
    return _clip(joints, values, rate)


class _Lines:
    """Lines with content, as words, with their numbers for messages."""

    def __init__(self, path: str | Path) -> None:
        self.path = path
        try:
            text = Path(path).read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", path=path) from error
        words = ((number, line.split()) for number, line in enumerate(text.splitlines(), start=1))
        self._rest: Iterator[tuple[int, list[str]]] = ((n, w) for n, w in words if w)
        self.number = 0

    def next(self, wanted: str) -> list[str]:
        """Words of the next line."""
        words = self.next_or_none()
        if words is None:
            raise self.error(f"the file ends here; expected {wanted}")
        return words

    def next_or_none(self) -> list[str] | None:
        found = next(self._rest, None)
        if found is None:
            return None
        self.number, words = found
        return words

    def expect(self, keyword: str) -> list[str]:
        """Words after a keyword the next line must begin with."""
        words = self.next(f"'{keyword}'")
        if words[0].lower() != keyword.lower():
            raise self.error(f"expected '{keyword}', not '{words[0]}'")
        return words[1:]

    def numbers(self, words: list[str], count: int, what: str) -> NDArray[np.float64]:
        """Words as finite numbers."""
        if len(words) != count:
            raise self.error(f"{what}: want {count} numbers, got {len(words)}")
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            raise self.error(f"{what}: '{bad}' is not a number") from None
        if not np.isfinite(values).all():
            raise self.error(f"{what}: '{words[int(np.argmin(np.isfinite(values)))]}' is not finite")
        return values

    def error(self, message: str) -> InputError:
        return InputError(message, path=self.path, line=self.number or None)


def _hierarchy(lines: _Lines) -> list[_Joint]:
    lines.expect("HIERARCHY")
    joints: list[_Joint] = []
    open_joints: list[int] = []
    words = lines.next("'ROOT'")
    while words[0].upper() != "MOTION":
        keyword = words[0].upper()
        inside = joints[open_joints[-1]] if open_joints else None
        if keyword in ("ROOT", "JOINT", "END"):
            if (keyword == "ROOT") != (inside is None):
                raise lines.error(f"{keyword} stands {'inside a joint' if inside else 'outside a ROOT'}")
            end = keyword == "END" and inside is not None
            name = f"{joints[open_joints[-1]].name} end" if end else " ".join(words[1:])
            if not name:
                raise lines.error(f"{keyword} without a name")
            joints.append(_Joint(name, open_joints[-1] if open_joints else -1, lines.number))
            open_joints.append(len(joints) - 1)
            lines.expect("{")
        elif keyword == "OFFSET" and inside is not None:
            inside.offset = lines.numbers(words[1:], 3, f"OFFSET of '{inside.name}'")
        elif keyword == "CHANNELS" and inside is not None:
            inside.channels = _channels(lines, words[1:], inside.name)
        elif keyword == "}" and inside is not None:
            if inside.offset is None:
                raise lines.error(f"'{inside.name}' of line {inside.line} has no OFFSET")
            open_joints.pop()
        else:
            raise lines.error(f"unexpected '{words[0]}'")
        words = lines.next("'}' or 'JOINT'" if open_joints else "'MOTION'")
    if open_joints:
        raise lines.error(f"'{joints[open_joints[-1]].name}' of line {joints[open_joints[-1]].line} is not closed")
    if not joints:
        raise lines.error("no ROOT before MOTION")
    return joints


def _channels(lines: _Lines, words: list[str], joint: str) -> list[tuple[str, int]]:
    if not words or not words[0].isdigit() or int(words[0]) != len(words) - 1:
        raise lines.error(f"CHANNELS of '{joint}': want their number, then as many names")
    for word in words[1:]:
        if word.lower() not in _CHANNELS:
            raise lines.error(f"CHANNELS of '{joint}': no channel '{word}'; known: Xposition … Zrotation")
    return [_CHANNELS[word.lower()] for word in words[1:]]


def _motion(lines: _Lines, channels: int) -> tuple[NDArray[np.float64], float]:
    words = lines.next("'Frames:'")
    if words[0].lower() != "frames:" or len(words) != 2 or not words[1].isdigit() or int(words[1]) == 0:
        raise lines.error("want 'Frames:' and how many, at least one")
    count = int(words[1])
    words = lines.next("'Frame Time:'")
    if [word.lower() for word in words[:2]] != ["frame", "time:"]:
        raise lines.error("want 'Frame Time:' and the seconds from frame to frame")
    seconds = lines.numbers(words[2:], 1, "Frame Time")[0]
    if seconds <= 0.0:
        raise lines.error(f"Frame Time must be above 0, got {seconds:g}")
    values = np.empty((count, channels))
    for frame in range(count):
        values[frame] = lines.numbers(lines.next(f"frame {frame} of {count}"), channels, f"frame {frame}")
    if lines.next_or_none() is not None:
        raise lines.error(f"more than the {count} frames announced")
    return values, round(1.0 / seconds, 3)


def _clip(joints: list[_Joint], values: NDArray[np.float64], rate: float) -> Clip:
    frames = len(values)
    parents = np.array([joint.parent for joint in joints], dtype=np.int64)
    rest = np.zeros((len(joints), 3))
    positions = np.zeros((frames, len(joints), 3))
    rotations = np.zeros((frames, len(joints), 4))
    column = 0
    for j, joint in enumerate(joints):
        offset = np.zeros(3) if joint.offset is None else joint.offset
        place = np.tile(offset, (frames, 1))
        turn = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 1))
        for kind, axis in joint.channels:
            if kind == "position":
                place[:, axis] = values[:, column]
            else:
                turn = multiply(turn, _about(axis, values[:, column]))
            column += 1
        if joint.parent < 0:
            rest[j], positions[:, j], rotations[:, j] = offset, place, turn
        else:
            rest[j] = rest[joint.parent] + offset
            positions[:, j] = positions[:, joint.parent] + rotate(rotations[:, joint.parent], place)
            rotations[:, j] = multiply(rotations[:, joint.parent], turn)
    return Clip(tuple(joint.name for joint in joints), parents, rest, positions, rotations, rate)


def _about(axis: int, degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    half = np.radians(degrees) / 2.0
    out = np.zeros((len(half), 4))
    out[:, axis], out[:, 3] = np.sin(half), np.cos(half)
    return out


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
