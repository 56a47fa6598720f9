"""Loading of rigs of any format; the file's suffix determines the reader."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.io.placement import METRES
from warpjld.io.source import SourceRig
from warpjld.rig import Rig
from warpjld.runtime.lazily import imported

__all__ = ["load_rig"]

_MOST_SCALE = 1e9  # surfaces are computed in float32, whose squares overflow at 1e38


def load_rig(
    path: str | Path,
    *,
    skeleton: str | Path | None = None,
    points: str | Path | None = None,
    side: str | None = None,
    unit: str | None = None,
    scale: float | None = None,
    up: str | None = None,
    joint_map: str | Path | Mapping[str, Any] | None = None,
    centre_joints: bool | None = None,
) -> Rig:
    """Load a rig: a skinned glTF, FBX, VRM or USD file, or any surface (OBJ, PLY, STL, …) with a skeleton file.

    Args:
        path: The file.
        skeleton: Skeleton file (JSON, see :mod:`warpjld.io.skeleton_file`); required if the surface has no joints.
        points: Points file (JSON, see :mod:`warpjld.io.points_file`) instead: an actor's 87 named points, or 25.
        side: ``left`` or ``right`` for a single hand, if the file does not determine it or is wrong.
        unit: ``m``, ``cm``, ``mm`` or ``in``; by default the file's, else guessed from a plausible size of hand or
            body, with a note.
        scale: Additional factor for all lengths; without ``unit`` nothing is guessed then.
        up: ``y`` or ``z``: the file's up axis; by default the stated one, else guessed; rotated to Y.
        joint_map: Stated joints, which override recognition: a JSON file (see :mod:`warpjld.io.joint_map_file`), or
            its content: ``{"left.knee": "LeftShin", "ignore": ["Socket"]}``.
        centre_joints: Whether joints clearly off the centre of a finger's or limb's flesh are moved there (see
            :mod:`warpjld.rig.centres`); the file's own joints are not changed.
    Returns:
        A rig with canonical joint names, in metres; each hand has 25 joints, of which missing ones are added.

    Raises:
        InputError: Unreadable, no joints, invalid data, or an invalid argument.

    Examples:
        >>> import json
        >>> from tempfile import mkdtemp
        >>> folder = Path(mkdtemp())
        >>> surface = "OFF;4 4 0;0 0 -1;0 0 6;1 0 2;0 1 2;3 0 2 1;3 0 1 3;3 1 2 3;3 0 3 2"
        >>> _ = (folder / "arm.off").write_text(surface.replace(";", "\\n"))
        >>> joints = [{"name": "low", "parent": None, "position": [0.2, 0.2, 0]}]
        >>> joints += [{"name": "high", "parent": "low", "position": [0.2, 0.2, 3]}]
        >>> _ = (folder / "arm.json").write_text(json.dumps({"joints": joints}))
        >>> wj.load_rig(folder / "arm.off", skeleton=folder / "arm.json", unit="m", up="y")
        Rig('arm': 2 joints, 4 vertices, 4 triangles)
    """
    from warpjld.io.assemble import assemble_rig

    for name, value, allowed in (
        ("side", side, ("left", "right")),
        ("unit", unit, tuple(METRES)),
        ("up", up, ("y", "z")),
    ):
        if value is not None and value not in allowed:
            raise InputError(f"{name}: want {' or '.join(repr(a) for a in allowed)}, got {value!r}")
    if scale is not None and not 1.0 / _MOST_SCALE <= scale <= _MOST_SCALE:
        raise InputError(f"scale: want a factor above 0, from {1.0 / _MOST_SCALE:g} to {_MOST_SCALE:g}, got {scale:g}")
    if isinstance(joint_map, str | Path):
        from warpjld.io.joint_map_file import read_joint_map

        joint_map = read_joint_map(joint_map)
    rig = assemble_rig(
        _read(Path(path), skeleton, points), side=side, unit=unit, scale=scale, up=up, joint_map=joint_map
    )
    if not centre_joints:
        return rig
    from warpjld.rig.centres import with_centred_joints

    return with_centred_joints(rig)


def _read(path: Path, skeleton: str | Path | None, points: str | Path | None) -> SourceRig:
    if not path.exists():
        raise InputError("no such file", path=path)
    check_input(path)
    if skeleton is not None and points is not None:
        raise InputError("give a skeleton file or a points file, not both", path=path)
    if points is not None:
        from warpjld.io.mesh_file import read_mesh
        from warpjld.io.points_file import read_points_file

        surface = read_mesh(path)
        with reading(points, "a points file"):
            return read_points_file(points, surface)
    if skeleton is not None:
        from warpjld.io.mesh_file import read_mesh
        from warpjld.io.skeleton_file import read_skeleton_file

        mesh = read_mesh(path)
        with reading(skeleton, "a skeleton file"):
            return read_skeleton_file(skeleton, mesh)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError("has no joints: give a skeleton file or a points file for this surface", path=path)
    read: Callable[[Path], SourceRig] = imported(reader)
    with reading(path, f"a rig ({path.suffix.lower()})"):
        return read(path)


_USD = ("warpjld.io.usd.separate_rig", "load_usd_rig")
_READERS = {
    ".glb": ("warpjld.io.gltf.skin", "read_gltf_rig"),
    ".gltf": ("warpjld.io.gltf.skin", "read_gltf_rig"),
    ".fbx": ("warpjld.io.fbx.rig", "read_fbx_rig"),
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
    ".usdz": _USD,
    ".vrm": ("warpjld.io.vrm", "read_vrm_rig"),
}
"""Suffix → reader of rigs; its module is imported when first used."""
