"""Reader of grasps from CSV files, one per row, angles in degrees.

Columns: ``object``; the hand's pose in the object's frame, ``x``, ``y``, ``z`` [m] and ``qw``, ``qx``, ``qy``, ``qz``;
one column per joint, ``index.base.flexion`` or a name from the joint map; optionally ``name``, ``hand``, ``scale``,
``friction`` and ``mass`` [kg]. An empty cell is the rest angle.
"""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.files.reading import reading
from warpjld.files.text_file import read_text
from warpjld.study.scoring.given import GivenGrasp, quaternion
from warpjld.study.scoring.reading_grasps import GraspReading, number_in

__all__ = ["read_channel_table"]

_PLACE, _TURN = ("x", "y", "z"), ("qw", "qx", "qy", "qz")
_NEEDED = ("object", *_PLACE, *_TURN)
_OTHER = ("name", "hand", "scale", "friction", "mass")


def read_channel_table(path: Path, how: GraspReading) -> list[GivenGrasp]:
    """Read the grasps of a CSV file.

    Raises:
        InputError: Missing or repeated columns, cells that are no numbers, unknown joints; names the line.
    """
    text = read_text(path)
    with reading(path, "CSV"):
        rows = [row for row in csv.reader(StringIO(text)) if row]
    if len(rows) < 2:
        raise InputError("want a line of column names, and one line per grasp", path=path)
    header = [name.strip() for name in rows[0]]
    if missing := [name for name in _NEEDED if name not in header]:
        raise InputError(f"has no column {', '.join(missing)}", path=path, line=1)
    if len(set(header)) != len(header):
        raise InputError(
            f"two columns are called '{next(n for n in header if header.count(n) > 1)}'", path=path, line=1
        )
    grasps = []
    for line, row in enumerate(rows[1:], 2):
        if len(row) != len(header):
            raise InputError(f"want {len(header)} cells, got {len(row)}", path=path, line=line)
        try:
            grasps.append(_grasp(dict(zip(header, (cell.strip() for cell in row), strict=True)), line, how))
        except InputError as error:
            raise InputError(error.message, path=path, line=line) from None
    return grasps


def _grasp(cells: dict[str, str], line: int, how: GraspReading) -> GivenGrasp:
    position = np.array([number_in(cells[name], name) for name in _PLACE])
    turn = quaternion(np.array([number_in(cells[name], name) for name in _TURN]), "qw, qx, qy, qz")
    angles = {name: cell for name, cell in cells.items() if name not in (*_NEEDED, *_OTHER) and cell}
    joints = {name: float(np.radians(number_in(cell, name))) for name, cell in angles.items()}
    more: dict[str, Any] = {"hand": cells.get("hand", "")}
    more |= {key: number_in(cells[key], key, above=0.0) for key in ("scale", "friction", "mass") if cells.get(key)}
    return how.posed(cells.get("name") or f"line {line}", cells["object"], position, turn, joints, **more)
