"""Motions as tables: a ``frame`` column, then channels in degrees, the root's displacement in metres."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.motion.channels import ROOT_CHANNELS, canonical_channels, resolve_channel
from warpjld.motion.tracks import Motion
from warpjld.skeleton import Skeleton
from warpjld.text_file import read_text
from warpjld.whole_file import whole_file

__all__ = ["read_csv", "write_csv"]


def read_csv(path: str | Path, *, skeleton: Skeleton | None = None, rate: float = 30.0) -> Motion:
    """Read a motion from a CSV file. An empty cell is no key: the spline runs on between its neighbours.

    Args:
        path: The file. First line: ``frame`` and channels, such as ``frame,index.base.flexion,wrist.pivot,root.y``.
        skeleton: Whose joints the channels must be; None to accept any.
        rate: Frames a second: the file does not say.

    Raises:
        InputError: Unreadable, no or a wrong header, an unknown joint, a cell that is not a number, frames that
            are missing or do not increase; with its line and column.
    """
    reader = csv.reader(read_text(path).splitlines())
    motion = Motion(rate=rate)
    header: list[str] | None = None
    last = -math.inf
    for cells in reader:
        line = reader.line_num
        if not any(cell.strip() for cell in cells):
            continue
        if header is None:
            header = _read_header(cells, skeleton, path, line)
            continue
        if len(cells) > len(header):
            raise InputError(f"{len(cells)} cells under {len(header)} headings", path=path, line=line)
        frame = _number(cells[0], path, line, 1)
        if frame is None:
            raise InputError("no frame number", path=path, line=line, column=1)
        if frame <= last:
            what = "stands here twice" if frame == last else f"does not come after frame {last:g}"
            raise InputError(f"frame {frame:g} {what}", path=path, line=line, column=1)
        last = frame
        for column, (channel, cell) in enumerate(zip(header[1:], cells[1:], strict=False), start=2):
            value = _number(cell, path, line, column)
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
    continuity or bias, which a table cannot hold, is written with every frame instead.

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
    names = [cell.strip() for cell in cells]
    if names[0].lower() != "frame":
        hint = "; cells are separated by commas" if len(names) == 1 and any(s in names[0] for s in ";\t") else ""
        raise InputError(f"first heading must be 'frame', not '{names[0]}'{hint}", path=path, line=line, column=1)
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


def _number(cell: str, path: str | Path, line: int, column: int) -> float | None:
    text = cell.strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"'{text}' is not a number", path=path, line=line, column=column) from None
    if not math.isfinite(value):
        raise InputError(f"'{text}' is not a finite number", path=path, line=line, column=column)
    return value


def _cell(channel: str, value: float | None) -> str:
    if value is None:
        return ""
    return f"{value if channel in ROOT_CHANNELS else math.degrees(value):.12g}"
