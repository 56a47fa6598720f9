"""Reader of the grasps of a warpjld study: its folder with the table and ``poses.npz``."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.array_file import read_arrays
from warpjld.files.reading import reading
from warpjld.files.text_file import read_text
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.reading_grasps import GraspReading, number_in
from warpjld.tables.files import read_table

__all__ = ["read_own_study", "study_tables"]

_TABLES = ("table.parquet", "table.csv")
_POSE = ("angles", "root_position", "root_rotation")


def study_tables(path: Path) -> Path | None:
    """Table of the study in a folder, or the given table, if ``poses.npz`` is in the same folder; else None."""
    tables = [path / name for name in _TABLES] if path.is_dir() else [path] if path.name in _TABLES else []
    return next((table for table in tables if table.is_file() and (table.parent / "poses.npz").is_file()), None)


def read_own_study(table: Path, how: GraspReading) -> list[GivenGrasp]:
    """Grasps of the trials that have a pose, in order.

    Raises:
        InputError: Damaged files, poses of another skeleton, or none.
    """
    listed = _rows(table)
    with reading(table, "a table of a study"):
        rows = {int(row["trial"]): row for row in listed}
    path = table.parent / "poses.npz"
    arrays = read_arrays(path)
    grasps: dict[int, GivenGrasp] = {}
    for name in arrays:
        hand, slash, kind = name.rpartition("/")
        if not slash or kind != "angles":
            continue
        skeleton = how.hand(hand).skeleton
        poses = {key: _array(arrays, f"{hand}/{key}", path) for key in _POSE}
        if poses["angles"].shape[1:] != (len(skeleton), 4):
            raise InputError(f"hand {hand}: the poses are those of another skeleton", path=path)
        for k, trial in enumerate(_array(arrays, f"{hand}/angles.trials", path).astype(int).tolist()):
            if trial not in rows:
                raise InputError(f"trial {trial} is not in {table.name}", path=path)
            grasps[trial] = _grasp(trial, rows[trial], hand, *(poses[key][k] for key in _POSE))
    if not grasps:
        raise InputError("no trial of this study has a pose", path=table)
    return [grasps[trial] for trial in sorted(grasps)]


def _grasp(
    trial: int,
    row: dict[str, Any],
    hand: str,
    angles: NDArray[np.float64],
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
) -> GivenGrasp:
    given = [key for key in ("scale", "friction", "mass") if row.get(key)]
    more: dict[str, Any] = {key: number_in(row[key], key, above=0.0) for key in given}
    return GivenGrasp(f"trial {trial}", str(row["object"]), position, rotation, angles=angles, hand=hand, **more)


def _rows(table: Path) -> list[dict[str, Any]]:
    if table.suffix == ".parquet":
        with reading(table, "Parquet"):
            rows = read_table(table)
    else:
        text = read_text(table)
        with reading(table, "CSV"):
            rows = list(csv.DictReader(StringIO(text)))
    if rows and (missing := [key for key in ("trial", "object", "scale", "friction", "mass") if key not in rows[0]]):
        raise InputError(f"is not the table of a grasp study: it has no column {', '.join(missing)}", path=table)
    return rows


def _array(arrays: dict[str, NDArray[Any]], name: str, path: Path) -> NDArray[Any]:
    if name not in arrays:
        raise InputError(f"has no '{name}': these are not the poses of a grasp study", path=path)
    if not np.isfinite(arrays[name]).all():
        raise InputError(f"'{name}' holds numbers that are not finite", path=path)
    return arrays[name]
