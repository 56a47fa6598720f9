"""Reading BVH files: a hierarchy of offsets, then a line of channel values a frame."""

from __future__ import annotations

import re
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


_COMMENT = re.compile(r"(^|\s)(//|#).*")
"""Nothing of the format begins with these; within a name they are the name's."""


@dataclass
class _Joint:
    name: str
    parent: int
    line: int
    offset: NDArray[np.float64] | None = None
    channels: list[tuple[str, int]] = field(default_factory=list)


def read_bvh(path: str | Path) -> Clip:
    """Read a BVH file: any hierarchy, any order of channels. End sites become joints called ``<parent> end``.

    Rotations apply in the order of their channels, each about an axis the previous ones have turned. Positions of
    joints below the root stand in place of their OFFSET in some files and add to it in others: whichever keeps bones
    nearer to their OFFSETs is meant.

    Tabs, a byte order mark, comments (``//`` or ``#`` and what follows), keywords without the blank after their colon,
    and another number of frames than announced are taken as they are, the last with a note, as is a last frame cut off.

    Raises:
        InputError: Unreadable, or not as the format wants it, with the line.
    """
    lines = _Lines(path)
    joints = _hierarchy(lines)
    values, rate, notes = _motion(lines, sum(len(joint.channels) for joint in joints))
    return _clip(joints, values, rate, notes)


class _Lines:
    """Lines with content, as words, with their numbers for messages."""

    def __init__(self, path: str | Path) -> None:
        self.path = path
        try:
            text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", path=path) from error
        lines = enumerate(text.split("\n"), start=1)  # not splitlines, which also breaks at form feeds
        words = ((number, _COMMENT.sub("", line).split()) for number, line in lines)
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

    def setting(self, keyword: str) -> list[str]:
        """Words after a keyword of one or two words and a colon, which a value may follow without a blank."""
        words = self.next(f"'{keyword}'")
        line = " ".join(words)
        if not line.lower().startswith(keyword.lower()):
            raise self.error(f"want '{keyword}' and its value, not '{line[:40]}'")
        return line[len(keyword) :].split()

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
    if not words or words[0] != str(len(words) - 1):
        raise lines.error(f"CHANNELS of '{joint}': want their number, then as many names")
    for word in words[1:]:
        if word.lower() not in _CHANNELS:
            raise lines.error(f"CHANNELS of '{joint}': no channel '{word}'; known: Xposition … Zrotation")
    return [_CHANNELS[word.lower()] for word in words[1:]]


def _motion(lines: _Lines, channels: int) -> tuple[NDArray[np.float64], float, list[str]]:
    """Rows of channel values, frames a second, and notes on rows more or fewer than announced."""
    if channels == 0:
        raise lines.error("no joint has CHANNELS: nothing moves")
    words = lines.setting("Frames:")
    if len(words) != 1 or not words[0].isascii() or not words[0].isdigit() or len(words[0]) > 9 or int(words[0]) == 0:
        raise lines.error("want 'Frames:' and how many, at least one")
    count = int(words[0])
    seconds = lines.numbers(lines.setting("Frame Time:"), 1, "Frame Time")[0]
    if seconds <= 0.0:
        raise lines.error(f"Frame Time must be above 0, got {seconds:g}")
    rows: list[NDArray[np.float64]] = []
    notes: list[str] = []
    words_next = lines.next_or_none()
    while words_next is not None:
        words, line = words_next, lines.number
        words_next = lines.next_or_none()
        if words_next is None and rows and len(words) < channels:
            notes.append(f"the last frame is cut off and left out: {len(words)} of {channels} numbers")
            break
        after, lines.number = lines.number, line
        rows.append(lines.numbers(words, channels, f"frame {len(rows)}"))
        lines.number = after
    if not rows:
        raise lines.error(f"the file ends here; expected frame 0 of {count}")
    if len(rows) != count:
        notes.append(f"the motion has {len(rows)} frames, not the {count} it announces: those that are there are taken")
    return np.array(rows), round(1.0 / seconds, 3), notes


def _clip(joints: list[_Joint], values: NDArray[np.float64], rate: float, notes: list[str]) -> Clip:
    frames = len(values)
    parents = np.array([joint.parent for joint in joints], dtype=np.int64)
    offsets = np.array([np.zeros(3) if joint.offset is None else joint.offset for joint in joints])
    rest = np.zeros((len(joints), 3))
    places = np.repeat(offsets[None], frames, axis=0)
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (frames, len(joints), 1))
    column = 0
    for j, joint in enumerate(joints):
        for kind, axis in joint.channels:
            if kind == "position":
                places[:, j, axis] = values[:, column]
            else:
                turns[:, j] = multiply(turns[:, j], _about(axis, values[:, column]))
            column += 1
    if _add_to_offsets(joints, places, offsets):
        for j, joint in enumerate(joints):
            for axis in (axis for kind, axis in joint.channels if kind == "position" and joint.parent >= 0):
                places[:, j, axis] += offsets[j, axis]
        notes = [*notes, "positions of joints are taken as additions to their OFFSETs"]
    positions, rotations = places.copy(), turns.copy()
    for j, parent in enumerate(parents):
        rest[j] = offsets[j]
        if parent >= 0:
            rest[j] += rest[parent]
            positions[:, j] = positions[:, parent] + rotate(rotations[:, parent], places[:, j])
            rotations[:, j] = multiply(rotations[:, parent], turns[:, j])
    return Clip(tuple(joint.name for joint in joints), parents, rest, positions, rotations, rate, tuple(notes))


def _add_to_offsets(joints: list[_Joint], places: NDArray[np.float64], offsets: NDArray[np.float64]) -> bool:
    """Whether position channels below the root state what is added to an OFFSET, as Blender writes them."""
    inner = [
        j for j, joint in enumerate(joints) if joint.parent >= 0 and any(k == "position" for k, _ in joint.channels)
    ]
    as_given = np.linalg.norm(places[:, inner] - offsets[inner], axis=-1).sum()
    added = np.linalg.norm(places[:, inner], axis=-1).sum()
    return bool(added < as_given)


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
