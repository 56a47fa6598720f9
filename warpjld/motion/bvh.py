"""Reader of BVH files: a hierarchy of offsets, then a line of channel values per frame."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.files.spilled_rows import SpilledRows
from warpjld.geometry.rotations import multiply, rotate
from warpjld.limits import check_limit
from warpjld.motion.bvh_lines import NAMED, BvhLines
from warpjld.motion.clip import Clip, streamed_clip

__all__ = ["read_bvh"]

_AXES = "xyz"
_CHANNELS = {f"{axis}{kind}": (kind, a) for a, axis in enumerate(_AXES) for kind in ("position", "rotation", "scale")}


_POSE_RATE = 30.0
"""Frames a second of a file with a single frame, whose frame time may be 0."""
_SLOWEST, _FASTEST = 1.0, 10000.0
"""Limits of plausible frame rates [1/s]."""


@dataclass
class _Joint:
    name: str
    parent: int
    line: int
    offset: NDArray[np.float64] | None = None
    channels: list[tuple[str, int]] = field(default_factory=list)


def read_bvh(path: str | Path) -> Clip:
    """Read a BVH file with any hierarchy and any order of channels. End sites become joints ``<parent> end``.

    Rotations apply in the order of their channels, each about an axis that the previous ones have turned. Position
    channels of joints below the root replace the OFFSET in some files and add to it in others: the reading that keeps
    bones closer to their OFFSETs is taken.

    Tabs, byte order marks, comments (``//`` or ``#`` to the end of the line), unusual line breaks, decimal commas,
    keywords without a blank after the colon, a number of frames other than announced, and a truncated last frame are
    accepted, the last two with a note. Scale channels are read and ignored.

    Raises:
        InputError: Unreadable, or not according to the format, with the line.
    """
    lines = BvhLines(path)
    joints = _hierarchy(lines)
    values, rate, notes = _motion(lines, sum(len(joint.channels) for joint in joints))
    return _clip(joints, values, rate, notes, tuple(_doubts(joints, values, rate)))


def _hierarchy(lines: BvhLines) -> list[_Joint]:
    lines.expect("HIERARCHY")
    joints: list[_Joint] = []
    open_joints: list[int] = []
    words = lines.next("'ROOT'")
    while words[0].upper() != "MOTION":
        keyword = words[0].upper()
        inside = joints[open_joints[-1]] if open_joints else None
        if keyword in NAMED:
            if (keyword == "ROOT") != (inside is None):
                raise lines.error(f"{keyword} stands {'inside a joint' if inside else 'outside a ROOT'}")
            end = keyword in ("END", "ENDSITE") and inside is not None
            name = f"{joints[open_joints[-1]].name} end" if end else " ".join(words[1:])
            if not name:
                raise lines.error(f"{keyword} without a name")
            check_limit("joints", len(joints) + 1, path=lines.path)
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


def _channels(lines: BvhLines, words: list[str], joint: str) -> list[tuple[str, int]]:
    if not words or words[0] != str(len(words) - 1):
        raise lines.error(f"CHANNELS of '{joint}': want their number, then as many names")
    names = [word.rstrip(",;") for word in words[1:]]
    for name in names:
        if name.lower() not in _CHANNELS:
            raise lines.error(f"CHANNELS of '{joint}': no channel '{name}'; known: Xposition … Zrotation")
    return [_CHANNELS[name.lower()] for name in names]


def _motion(lines: BvhLines, channels: int) -> tuple[SpilledRows, float, list[str]]:
    """Rows of channel values, frames a second, and notes on a wrong number of rows."""
    if channels == 0:
        raise lines.error("no joint has CHANNELS: nothing moves")
    words = lines.setting("Frames")
    count = _count(words[0]) if len(words) == 1 else None
    if count is None:
        raise lines.error("want 'Frames:' and how many")
    seconds = lines.numbers(lines.setting("Frame Time"), 1, "Frame Time")[0]
    timed = lines.number
    rows, notes = _rows(lines, channels, count)
    if seconds <= 0.0 and len(rows) == 1:
        seconds = 1.0 / _POSE_RATE
    elif seconds <= 0.0:
        lines.number = timed
        raise lines.error(f"Frame Time must be above 0, got {seconds:g}")
    if len(rows) != count:
        notes.append(f"the motion has {len(rows)} frames, not the {count} it announces: those that are there are taken")
    rate = 1.0 / seconds
    return rows, round(rate, 3) if rate > _SLOWEST else rate, notes


def _rows(lines: BvhLines, channels: int, count: int) -> tuple[SpilledRows, list[str]]:
    """Channel values of every frame, and notes; line breaks are ignored if the numbers fill all frames exactly."""
    rows = SpilledRows(channels)
    notes: list[str] = []
    words_next = lines.next_or_none()
    while words_next is not None:
        words, line = words_next, lines.number
        words_next = lines.next_or_none()
        if words_next is None and len(rows) and len(words) < channels:
            notes.append(f"the last frame is cut off and left out: {len(words)} of {channels} numbers")
            break
        if len(words) != channels and not len(rows):
            first = len(words)
            while words_next is not None and len(words) < count * channels:
                words += words_next
                words_next = lines.next_or_none()
            if len(words) == count * channels and words_next is None:
                rows.extend(lines.numbers(words, len(words), "frames").reshape(count, channels))
                return rows, notes
            lines.number = line
            raise lines.error(f"frame 0: want {channels} numbers, got {first}")
        after, lines.number = lines.number, line
        rows.extend(lines.numbers(words, channels, f"frame {len(rows)}")[None])
        lines.number = after
    if not len(rows):
        raise lines.error(f"the file ends here; expected frame 0 of {count}")
    return rows, notes


def _count(word: str) -> int | None:
    """The word as a non-negative integer; None if it is none."""
    whole = re.fullmatch(r"([0-9]{1,15})([.,]0*)?", word, re.ASCII)
    return int(whole[1]) if whole else None


def _doubts(joints: list[_Joint], values: SpilledRows, rate: float) -> list[str]:
    """Warnings about values that are ignored or implausible."""
    found = []
    kinds = [(joint.name, kind) for joint in joints for kind, _ in joint.channels]
    scales = [column for column, (_, kind) in enumerate(kinds) if kind == "scale"]
    spans = [[np.min(some, axis=0), np.max(some, axis=0)] for block in values.blocks() for some in (block[:, scales],)]
    low, high = np.min([a for a, _ in spans], axis=0), np.max([b for _, b in spans], axis=0)
    moving = high - low > 1e-3 * np.maximum(np.abs(low), np.abs(high))
    scaled = [kinds[column][0] for column, moves in zip(scales, moving, strict=True) if moves]
    if scaled:
        found.append(f"the motion scales {', '.join(dict.fromkeys(scaled))}: scale is not followed")
    if len(values) > 1 and not _SLOWEST < rate < _FASTEST:
        found.append(f"a frame lasts {1.0 / rate:g} s, as the file says: are other units meant?")
    return found


def _clip(joints: list[_Joint], values: SpilledRows, rate: float, notes: list[str], warnings: tuple[str, ...]) -> Clip:
    names, parents = tuple(joint.name for joint in joints), np.array([joint.parent for joint in joints], dtype=np.int64)
    offsets = np.array([np.zeros(3) if joint.offset is None else joint.offset for joint in joints])
    rest = offsets.copy()
    for j, parent in enumerate(parents):
        if parent >= 0:
            rest[j] += rest[parent]
    added = _add_to_offsets(joints, values, offsets)
    if added:
        notes = [*notes, "positions of joints are taken as additions to their OFFSETs"]
    remarks = tuple(notes)

    def some(frames: slice) -> Clip:
        positions, rotations = _worlds(joints, values[frames], offsets, added=added)
        return Clip(names, parents, rest, positions, rotations, rate, remarks, warnings)

    return streamed_clip(len(values), some)


def _worlds(
    joints: list[_Joint], values: NDArray[np.float64], offsets: NDArray[np.float64], *, added: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (f, B, 3) and rotations (f, B, 4) of all joints."""
    positions = _places(joints, values, offsets)
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(values), len(joints), 1))
    column = 0
    for j, joint in enumerate(joints):
        for kind, axis in joint.channels:
            if kind == "rotation":
                rotations[:, j] = multiply(rotations[:, j], _about(axis, values[:, column]))
            elif kind == "position" and added and joint.parent >= 0:
                positions[:, j, axis] += offsets[j, axis]
            column += 1
        if joint.parent >= 0:
            positions[:, j] = positions[:, joint.parent] + rotate(rotations[:, joint.parent], positions[:, j])
            rotations[:, j] = multiply(rotations[:, joint.parent], rotations[:, j])
    return positions, rotations


def _places(joints: list[_Joint], values: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions relative to the parent, position channels taken as given, shape (f, B, 3)."""
    places = np.repeat(offsets[None], len(values), axis=0)
    column = 0
    for j, joint in enumerate(joints):
        for kind, axis in joint.channels:
            if kind == "position":
                places[:, j, axis] = values[:, column]
            column += 1
    return places


def _add_to_offsets(joints: list[_Joint], values: SpilledRows, offsets: NDArray[np.float64]) -> bool:
    """Whether position channels below the root add to the OFFSET, as Blender writes them."""
    inner = [
        j for j, joint in enumerate(joints) if joint.parent >= 0 and any(k == "position" for k, _ in joint.channels)
    ]
    if not inner:
        return False
    as_given = added = 0.0
    for block in values.blocks():
        places = _places(joints, block, offsets)[:, inner]
        as_given += float(np.linalg.norm(places - offsets[inner], axis=-1).sum())
        added += float(np.linalg.norm(places, axis=-1).sum())
    return added < as_given


def _about(axis: int, degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    half = np.radians(degrees) / 2.0
    out = np.zeros((len(half), 4))
    out[:, axis], out[:, 3] = np.sin(half), np.cos(half)
    return out
