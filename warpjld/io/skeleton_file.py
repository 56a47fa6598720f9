"""Skeleton files (JSON): the joints of a surface that has none of its own.

::

    {
      "joints": [
        {"name": "left.wrist", "parent": null, "position": [0, 0, 0]},
        {"name": "left.index.base", "parent": "left.wrist", "position": [0, 0, -0.09],
         "axis": [-1, 0, 0], "limits": {"flexion": [-45, 90]}, "initial": {"flexion": 12}}
      ]
    }

Positions are in the surface's own unit and axes. Names may be canonical or of any recognised convention; ``axis`` (the
flexion axis), ``limits`` (degrees, per channel) and ``initial`` (degrees, per channel: angles of the digitised pose,
counted from the straight joint) are optional and override computed values.
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
from warpjld.io.mesh_file import MeshFile
from warpjld.io.source import SourceRig
from warpjld.limits import check_limit
from warpjld.skeleton.actor_points import CANONICAL
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.tree import CHANNELS, Skeleton
from warpjld.suggest import did_you_mean

__all__ = ["read_skeleton_file", "write_skeleton_file"]

_KEYS = ("name", "parent", "position", "axis", "limits", "initial")


def read_skeleton_file(path: str | Path, mesh: MeshFile) -> SourceRig:
    """A surface with the joints of a skeleton file.

    Raises:
        InputError: Unreadable, or an entry that is invalid by the description above.
    """
    path = Path(path)
    content = read_json(path)
    try:
        return _rig(path, content, mesh)
    except InputError as error:
        raise InputError(error.message, path=path) from None


def _rig(path: Path, content: Any, mesh: MeshFile) -> SourceRig:
    entries = content.get("joints") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not entries:
        raise InputError('want {"joints": [{"name": …, "parent": …, "position": [x, y, z]}, …]}')
    check_limit("joints", len(entries))
    number: dict[str, int] = {}
    for i, entry in enumerate(entries):
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
            raise InputError(f"joint {i} has no name")
        unknown = next((key for key in entry if key not in _KEYS), None)
        if unknown is not None:
            raise InputError(f"joint '{entry['name']}': no key '{unknown}'{did_you_mean(unknown, _KEYS)}")
        if entry["name"] in number:
            raise InputError(f"two joints are called '{entry['name']}'")
        number[entry["name"]] = i
    names = list(number)
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    parents = np.full(len(names), -1)
    axes: dict[int, NDArray[np.float64]] = {}
    limits: dict[int, dict[str, tuple[float, float]]] = {}
    initial: dict[int, dict[str, float]] = {}
    for j, entry in enumerate(entries):
        frames[j, :3, 3] = _vector(entry.get("position"), names[j], "position")
        above = entry.get("parent")
        if above is not None:
            if not isinstance(above, str) or above not in number:
                raise InputError(
                    f"joint '{names[j]}': no joint '{above}' to be its parent{did_you_mean(str(above), names)}"
                )
            parents[j] = number[above]
        if entry.get("axis") is not None:
            axes[j] = _vector(entry["axis"], names[j], "axis")
            if not np.linalg.norm(axes[j]) > 0:
                raise InputError(f"joint '{names[j]}': its axis has no length")
        if entry.get("limits") is not None:
            limits[j] = _limits(entry["limits"], names[j])
        if entry.get("initial") is not None:
            initial[j] = _initial(entry["initial"], names[j])
    _check_loops(names, parents)
    # an actor's 87 points, by their own or their canonical names, possibly with other joints
    spelled = next((way for way in (list(CANONICAL), list(CANONICAL.values())) if number.keys() >= set(way)), None)
    return SourceRig(
        path=mesh.path,
        tree=SourceTree(tuple(names), parents, frames),
        vertices=mesh.vertices,
        faces=mesh.faces,
        uv=mesh.uv,
        corner_uv=mesh.corner_uv,
        parts=mesh.parts,
        polygons=mesh.polygons,
        axes=axes,
        limits=limits,
        initial=initial,
        placed=spelled is not None,
        stated={} if spelled is None else dict(zip(CANONICAL.values(), map(number.__getitem__, spelled), strict=True)),
        notes=(*mesh.notes, f"joints from {path.name}"),
    )


def _vector(value: Any, name: str, key: str) -> NDArray[np.float64]:
    if isinstance(value, list) and len(value) == 3 and all(isinstance(x, int | float) for x in value):
        vector = np.array(value, dtype=np.float64)
        if np.isfinite(vector).all():
            return vector
    raise InputError(f"joint '{name}': {key} wants three finite numbers, got {value!r:.60}")


def _limits(value: Any, name: str) -> dict[str, tuple[float, float]]:
    if not isinstance(value, Mapping):
        raise InputError(f"joint '{name}': limits want {{\"flexion\": [smallest, largest], …}} in degrees")
    out = {}
    for channel, pair in value.items():
        if channel not in CHANNELS:
            raise InputError(f"joint '{name}': no channel '{channel}'{did_you_mean(channel, CHANNELS)}")
        good = isinstance(pair, list) and len(pair) == 2 and all(isinstance(x, int | float) for x in pair)
        if not good or not -360 <= pair[0] <= pair[1] <= 360:
            raise InputError(
                f"joint '{name}': limits of {channel} want [smallest, largest] in degrees, −360 to 360, "
                f"got {pair!r:.40}"
            )
        out[channel] = (float(np.radians(pair[0])), float(np.radians(pair[1])))
    return out


def _initial(value: Any, name: str) -> dict[str, float]:
    if not isinstance(value, Mapping):
        raise InputError(f"joint '{name}': initial wants {{\"flexion\": degrees, …}}")
    for channel, angle in value.items():
        if channel not in CHANNELS:
            raise InputError(f"joint '{name}': no channel '{channel}'{did_you_mean(channel, CHANNELS)}")
        if not isinstance(angle, int | float) or isinstance(angle, bool) or not -360 <= angle <= 360:
            raise InputError(f"joint '{name}': initial {channel} wants degrees, −360 to 360, got {angle!r:.40}")
    return {channel: float(np.radians(angle)) for channel, angle in value.items()}


def _check_loops(names: list[str], parents: NDArray[np.int64]) -> None:
    rooted: set[int] = set()
    for j in range(len(names)):
        path: dict[int, None] = {}
        above = j
        while above >= 0 and above not in rooted:
            if above in path:
                raise InputError(f"joint '{names[j]}' is its own ancestor")
            path[above] = None
            above = int(parents[above])
        rooted.update(path)


def write_skeleton_file(path: str | Path, skeleton: Skeleton) -> None:
    """Write a skeleton as a skeleton file, from which the same skeleton can be read.

    Raises:
        InputError: It cannot be written.
    """
    joints = []
    for j, name in enumerate(skeleton.names):
        parent = int(skeleton.parents[j])
        joints.append(
            {
                "name": name,
                "parent": skeleton.names[parent] if parent >= 0 else None,
                "position": [round(float(x), 7) for x in skeleton.rest[j]],
                "axis": [round(float(x), 7) for x in skeleton.axes[j]],
                "limits": {
                    channel: [round(float(x), 3) for x in np.degrees(pair)]
                    for channel, pair in zip(CHANNELS, skeleton.limits[j], strict=True)
                },
                "initial": {
                    channel: round(float(np.degrees(angle)), 6)
                    for channel, angle in zip(CHANNELS, skeleton.initial[j], strict=True)
                },
            }
        )
    lines = ",\n".join("    " + json.dumps(joint) for joint in joints)
    try:
        with whole_file(Path(path)) as part:
            part.write_text(f'{{\n  "joints": [\n{lines}\n  ]\n}}\n', "utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", path=path) from None
