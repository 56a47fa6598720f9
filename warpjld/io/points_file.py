"""Points files (JSON): the named points of an actor (87) or of one hand (25) in a digitised surface (B §2.1, R12).

::

    {
      "points": {
        "pelvis": [0.0, 0.98, 0.01],
        "left.shoulder": [0.18, 1.42, -0.02],
        ...
      }
    }

Positions are in the surface's own unit and axes. All points of a set are required; their meaning and parents are in
:mod:`warpjld.skeleton.actor_points`. They are used as joints unchanged: none is merged, moved or added.
``warpjld place SURFACE -o points.json`` proposes them, for correction by hand.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.text_file import read_json
from warpjld.files.whole_file import whole_file
from warpjld.geometry.inside_out import is_inside_out
from warpjld.io.mesh_file import MeshFile
from warpjld.io.source import SourceRig
from warpjld.skeleton.actor_points import ACTOR_PARENTS, ACTOR_POINTS, CANONICAL, point_set
from warpjld.skeleton.recognise.placing.inside import outside_surface
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.suggest import did_you_mean

__all__ = ["read_points_file", "write_points_file"]

_LISTED = 4  # most points outside the surface that are told one by one
_SAME = 1e-6  # distance up to which points coincide, per size of the surface


def read_points_file(path: str | Path, mesh: MeshFile) -> SourceRig:
    """A surface with the points of a points file as joints.

    Raises:
        InputError: Unreadable; an unknown, missing or invalid point, or two that coincide.
    """
    path = Path(path)
    content = read_json(path)
    try:
        points = _points(content)
        _check_apart(points, float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))))
    except InputError as error:
        raise InputError(error.message, path=path) from None
    names = tuple(points)
    number = {name: j for j, name in enumerate(names)}
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = list(points.values())
    parents = [number.get(ACTOR_PARENTS[name] or "", -1) for name in names]
    faces = mesh.faces[:, ::-1] if is_inside_out(mesh.vertices, mesh.faces) else mesh.faces
    outside = [names[j] for j in np.flatnonzero(outside_surface(mesh.vertices, faces, frames[:, :3, 3]))]
    doubts = [f"{path.name}: {name} lies outside the surface" for name in outside]
    if len(outside) > _LISTED:
        shown = f"{', '.join(outside[:_LISTED])} and {len(outside) - _LISTED} more"
        doubts = [
            f"{path.name}: {len(outside)} of {len(names)} points lie outside the surface ({shown}): "
            "want positions in the unit and axes of its file"
        ]
    return SourceRig(
        path=mesh.path,
        tree=SourceTree(names, np.array(parents), frames),
        vertices=mesh.vertices,
        faces=mesh.faces,
        uv=mesh.uv,
        corner_uv=mesh.corner_uv,
        parts=mesh.parts,
        polygons=mesh.polygons,
        stated={CANONICAL[name]: number[name] for name in names},
        placed=True,
        notes=(*mesh.notes, f"{len(names)} points from {path.name}"),
        suspicious=tuple(doubts),
    )


def _points(content: Any) -> dict[str, NDArray[np.float64]]:
    """The points in canonical order."""
    table = content.get("points") if isinstance(content, dict) else None
    if not isinstance(table, dict) or not table:
        raise InputError('want {"points": {"pelvis": [x, y, z], …}}')
    unknown = next((name for name in table if name not in ACTOR_POINTS), None)
    if unknown is not None:
        raise InputError(f"no point '{unknown}'{did_you_mean(unknown, ACTOR_POINTS)}")
    wanted = point_set(table)
    missing = [name for name in wanted if name not in table]
    if missing:
        shown = ", ".join(missing[:4]) + (f" and {len(missing) - 4} more" if len(missing) > 4 else "")
        raise InputError(f"{len(table)} of {len(wanted)} points: no {shown}")
    out = {}
    for name in wanted:
        value = table[name]
        good = isinstance(value, list) and len(value) == 3 and all(type(x) in (int, float) for x in value)
        if not good or not np.isfinite(np.array(value, dtype=np.float64)).all():
            raise InputError(f"point '{name}' wants three finite numbers, got {value!r:.60}")
        out[name] = np.array(value, dtype=np.float64)
    return out


def _check_apart(points: Mapping[str, NDArray[np.float64]], size: float) -> None:
    names, places = list(points), np.array(list(points.values()))
    for j in range(1, len(names)):
        near = np.flatnonzero(np.linalg.norm(places[:j] - places[j], axis=1) <= _SAME * size)
        if len(near):
            raise InputError(f"points '{names[near[0]]}' and '{names[j]}' lie at the same place")


def write_points_file(path: str | Path, points: Mapping[str, NDArray[np.float64]]) -> None:
    """Write points, in the surface's own unit and axes, as a points file.

    Raises:
        InputError: It cannot be written.
    """
    lines = ",\n".join(
        f"    {json.dumps(name)}: [{', '.join(f'{float(x):.7g}' for x in place)}]" for name, place in points.items()
    )
    try:
        with whole_file(Path(path)) as part:
            part.write_text(f'{{\n  "points": {{\n{lines}\n  }}\n}}\n', "utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", path=path) from None
