"""Motions as CSV tables: a ``frame`` column, then channels in degrees, the root's displacement in metres.

Cells are separated by commas, semicolons or tabs, whichever makes ``frame`` the first heading, or as stated by a first
line ``sep=;``, as spreadsheets write it. Numbers have decimal points, or decimal commas throughout the file.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.files.text_file import read_text
from warpjld.files.whole_file import whole_file
from warpjld.motion.channels import ROOT_CHANNELS, canonical_channels, resolve_channel
from warpjld.motion.tracks import Motion
from warpjld.skeleton import Skeleton

if TYPE_CHECKING:
    import _csv

__all__ = ["read_csv", "write_csv"]

_SEPARATORS = ",;\t"
_SAID = re.compile(r"sep=([,;\t])", re.IGNORECASE)


def read_csv(path: str | Path, *, skeleton: Skeleton | None = None, rate: float = 30.0) -> Motion:
    """Read a motion from a CSV file. An empty cell sets no key: the spline interpolates its neighbours.

    Args:
        path: The file. First line: ``frame`` and channels, such as ``frame,index.base.flexion,wrist.pivot,root.y``.
        skeleton: Skeleton that must have the channels' joints; None to accept any.
        rate: Frames a second, which the file does not state.

    Raises:
        InputError: Unreadable, no or a wrong header, an unknown joint, a cell that is not a number, decimal points and
            commas in one file, frames that are missing or do not increase; with its line and column.
    """
    lines = read_text(path).splitlines()
    separator, skipped = _separator(lines)
    reader = csv.reader(lines[skipped:], delimiter=separator, skipinitialspace=True)
    try:
        return _read_rows(reader, skipped, separator, path, skeleton, rate)
    except csv.Error as error:
        raise InputError(f"is not a table: {error}", path=path, line=skipped + reader.line_num) from None


def _separator(lines: Sequence[str]) -> tuple[str, int]:
    """The cell separator, and the number of lines up to a ``sep=`` line, which are to be skipped."""
    first = next((k for k, line in enumerate(lines) if line.strip()), 0)
    if lines and (said := _SAID.fullmatch(lines[first].strip('\ufeff "\r\n'))):
        return said[1], first + 1
    header = lines[first] if lines else ""
    for separator in _SEPARATORS:
        if re.match(rf'\s*"?\s*frame\s*"?\s*{separator}', header, re.IGNORECASE):
            return separator, 0
    return max(_SEPARATORS, key=header.count), 0


def _read_rows(
    reader: _csv.Reader, skipped: int, separator: str, path: str | Path, skeleton: Skeleton | None, rate: float
) -> Motion:
    motion = Motion(rate=rate)
    marks: dict[str, int] = {}
    header: list[str] | None = None
    last = -math.inf
    for cells in reader:
        line = skipped + reader.line_num
        while cells and not cells[-1].strip():  # trailing separators
            cells.pop()
        if not any(cell.strip() for cell in cells):
            continue
        if header is None:
            header = _read_header(cells, skeleton, path, line)
            continue
        if len(cells) > len(header):
            hint = "; decimal commas need semicolons or tabs between cells" if separator == "," else ""
            raise InputError(f"{len(cells)} cells under {len(header)} headings{hint}", path=path, line=line)
        whole = re.fullmatch(r"\s*([0-9]+)[.,]0\s*", cells[0], re.ASCII)  # with either decimal mark
        frame = float(whole[1]) if whole else _number(cells[0], marks, path, line, 1)
        if frame is None:
            raise InputError("no frame number", path=path, line=line, column=1)
        if frame <= last:
            what = "stands here twice" if frame == last else f"does not come after frame {last:g}"
            raise InputError(f"frame {frame:g} {what}", path=path, line=line, column=1)
        last = frame
        for column, (channel, cell) in enumerate(zip(header[1:], cells[1:], strict=False), start=2):
            value = _number(cell, marks, path, line, column)
            if value is not None:
                motion.set_key(channel, frame, value if channel in ROOT_CHANNELS else math.radians(value))
    if header is None:
        raise InputError("empty; want a line 'frame,<joint>.<channel>,…'", path=path)
    if not motion.tracks:
        raise InputError("no keys under the headings", path=path)
    return motion


def write_csv(path: str | Path, motion: Motion, *, frames: ArrayLike | None = None) -> None:
    """Write a motion as a CSV file.

    Without ``frames`` the keys are written, if reading them back gives the same splines; a motion with tension,
    continuity or bias, which a table cannot hold, is sampled at every frame instead.

    Args:
        path: The file to write.
        motion: The motion.
        frames: Frames to sample, one row each.
    """
    channels = list(motion.tracks)
    keys = [key for track in motion.tracks.values() for key in track.keys]
    if frames is None and any((key.tension, key.continuity, key.bias) != (0.0, 0.0, 0.0) for key in keys):
        frames = motion.frames
    if frames is None:
        values = {(c, key.frame): key.value for c in channels for key in motion.tracks[c].keys}
        at = sorted({key.frame for key in keys})
        rows = [[values.get((c, frame)) for c in channels] for frame in at]
    else:
        at = np.atleast_1d(np.asarray(frames, dtype=np.float64)).tolist()
        rows = [list(row) for row in zip(*(motion.value(c, at).tolist() for c in channels), strict=True)]
    with whole_file(Path(path)) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["frame", *channels])
        for frame, row in zip(at, rows, strict=True):
            writer.writerow([f"{frame:.12g}", *(_cell(c, value) for c, value in zip(channels, row, strict=True))])


def _read_header(cells: list[str], skeleton: Skeleton | None, path: str | Path, line: int) -> list[str]:
    names = [re.sub(r"\s*\.\s*", ".", cell.strip()) for cell in cells]
    if names[0].lower() != "frame":
        raise InputError(f"first heading must be 'frame', not '{names[0]}'", path=path, line=line, column=1)
    if len(names) == 1:
        raise InputError("no channels after 'frame'", path=path, line=line)
    seen: dict[object, str] = {}
    for column, name in enumerate(names[1:], start=2):
        try:
            for channel in canonical_channels(name):
                known = skeleton is not None and channel not in ROOT_CHANNELS
                place = resolve_channel(channel, skeleton) if known and skeleton is not None else channel
                if place in seen:
                    raise InputError(f"'{name}' and '{seen[place]}' are the same channel")
                seen[place] = name
        except InputError as error:
            raise InputError(error.message, path=path, line=line, column=column) from error
    return [names[0], *(name.lower() for name in names[1:])]


def _number(cell: str, marks: dict[str, int], path: str | Path, line: int, column: int) -> float | None:
    """A cell's number; None where it is empty.

    Args:
        cell: The cell.
        marks: Decimal marks → line of first occurrence; updated.
        path: For messages, as line and column.
    """
    text = cell.strip().replace("\N{MINUS SIGN}", "-")
    if not text:
        return None
    for mark in ".,":
        if mark in text:
            marks.setdefault(mark, line)
    if ("." in text and "," in text) or text.count(",") > 1:
        raise InputError(f"'{text}': want numbers without thousands separators", path=path, line=line, column=column)
    if len(marks) > 1:
        other = marks["." if "," in text else ","]
        what = "a decimal comma" if "," in text else "a decimal point"
        raise InputError(f"'{text}': {what}, but line {other} has the other", path=path, line=line, column=column)
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        raise InputError(f"'{text}' is not a number", path=path, line=line, column=column) from None
    if not math.isfinite(value):
        raise InputError(f"'{text}' is not a finite number", path=path, line=line, column=column)
    return value


def _cell(channel: str, value: float | None) -> str:
    if value is None:
        return ""
    return f"{value if channel in ROOT_CHANNELS else math.degrees(value):.12g}"
