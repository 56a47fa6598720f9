"""Content of an FBX file in metres, right-handed and Y up."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, MissingExtraError
from warpjld.files.spilled_rows import SpilledRows
from warpjld.io.fbx.extract import FBX_ARRAYS, FBX_FRAMES
from warpjld.runtime.separate import separately

__all__ = ["FbxMesh", "FbxScene", "FbxSkin", "FbxStack", "read_scene"]

_FURTHEST = 1e12  # largest plausible coordinate in the file's units
_PER_BYTE = 200
"""Memory for each byte of a file: its elements are Python objects, which are never freed."""


@dataclass(frozen=True, eq=False)
class FbxSkin:
    """A painted skin of C clusters and P influences.

    Attributes:
        nodes: Node of every cluster, shape (C,).
        binds: Its node-to-world transform at bind time [m], shape (C, 4, 4).
        inverses: Geometry-to-node transforms at bind time, shape (C, 4, 4).
        cluster: Cluster of every influence, shape (P,).
        vertex: Vertex of every influence, shape (P,).
        weight: Weight of every influence, shape (P,).
    """

    nodes: NDArray[np.int64]
    binds: NDArray[np.float64]
    inverses: NDArray[np.float64]
    cluster: NDArray[np.int64]
    vertex: NDArray[np.int64]
    weight: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FbxMesh:
    """A mesh at a node, in its local coordinates.

    Attributes:
        name: Name of its node.
        node: Index of its node.
        points: Vertices, with blend shapes at their weights in the file, shape (W, 3).
        counts: Number of corners of every polygon.
        corners: Vertex of every corner.
        uv: Texture coordinates of every corner, origin at the image's lower left, or None.
        shown: Geometry-to-world transform of the displayed pose [m], shape (4, 4).
        skin: Its skin, or None.
        texture: File of its base colour texture, as the file names it; empty without one.
    """

    name: str
    node: int
    points: NDArray[np.float64]
    counts: NDArray[np.int64]
    corners: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    shown: NDArray[np.float64]
    skin: FbxSkin | None
    texture: str = ""


@dataclass(frozen=True)
class FbxStack:
    """An animation: name, length [s], number of moved nodes, and whether it moves blend shapes."""

    name: str
    length: float
    moving: int
    shapes: bool = False


@dataclass(frozen=True, eq=False)
class FbxScene:
    """Content of a file with N nodes.

    Attributes:
        path: The file.
        names: Nodes' names.
        parents: Their parents, which come first, -1 for the scene's root, shape (N,).
        kinds: ``bone``, ``null``, ``mesh``, ``lod`` or ``other``.
        shown: Node-to-world transforms of the displayed pose [m], shape (N, 4, 4).
        pose: Node-to-world transforms of the file's bind pose, NaN for nodes that are not in it.
        meshes: Meshes in the order of their nodes.
        stacks: Animations.
        worlds: Node-to-world transforms of the requested animation, a row of N × 16 numbers per frame; None without
            an animation.
        rate: Frames a second.
        title: Name of that animation.
        notes: What was left out.
    """

    path: Path
    names: tuple[str, ...]
    parents: NDArray[np.int64]
    kinds: tuple[str, ...]
    shown: NDArray[np.float64]
    pose: NDArray[np.float64]
    meshes: tuple[FbxMesh, ...]
    stacks: tuple[FbxStack, ...]
    worlds: SpilledRows | None
    rate: float
    title: str
    notes: tuple[str, ...]


def read_scene(path: str | Path, *, animated: bool = False, name: str | None = None, rate: float = 0.0) -> FbxScene:
    """Read an FBX file.

    Args:
        path: The file.
        animated: Whether to read an animation.
        name: Name of the animation; None for the first that moves anything.
        rate: Frames a second; 0 for the file's own.

    Raises:
        InputError: The file cannot be read, or contains a transform or vertex that is not finite.
        MissingExtraError: Without ufbx.
    """
    path = Path(path)
    if find_spec("ufbx") is None:
        raise MissingExtraError("FBX", "fbx")
    try:
        empty = path.stat().st_size == 0
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    if empty:
        raise InputError("is empty: an FBX file was expected", path=path)
    told, arrays, worlds = _extract(path, animated, name or "", rate)
    axes = _world_axes(told["axes"], told["unit"])
    meshes = tuple(_mesh(arrays, i, mesh, axes, path) for i, mesh in enumerate(told["meshes"]))
    names = tuple(name or f"node {n}" for n, name in enumerate(told["names"]))
    for transforms in (arrays["shown"], np.nan_to_num(arrays["pose"])):
        _check(transforms, names, path)
    worlds = None if worlds is None else _placed(worlds, axes, names, path)
    return FbxScene(
        path=path,
        names=names,
        parents=np.array(told["parents"], dtype=np.int64),
        kinds=tuple(told["kinds"]),
        shown=axes @ arrays["shown"],
        pose=axes @ arrays["pose"],
        meshes=meshes,
        stacks=tuple(FbxStack(s["name"], s["end"] - s["begin"], len(s["curved"]), s["shapes"]) for s in told["stacks"]),
        worlds=worlds,
        rate=told["rate"],
        title=told.get("chosen", ""),
        notes=tuple(told["notes"]),
    )


def _placed(worlds: SpilledRows, axes: NDArray[np.float64], names: tuple[str, ...], path: Path) -> SpilledRows:
    """Transforms of all frames in metres, right-handed, Y up."""
    out = SpilledRows(16 * len(names))
    for block in worlds.blocks():
        transforms = block.reshape(-1, len(names), 4, 4)
        _check(transforms, names, path)
        out.extend((axes @ transforms).reshape(len(block), -1))
    return out


def _extract(
    path: Path, animated: bool, name: str, rate: float
) -> tuple[dict[str, Any], dict[str, NDArray[Any]], SpilledRows | None]:
    """What :mod:`extract` finds in a process of its own, since ufbx may crash on a broken file; the transforms of an
    animation are a table with a row per frame."""
    place = ("warpjld.io.fbx.extract", "leave_fbx")
    with separately(place, path, "FBX", animated, name, rate, per_byte=_PER_BYTE, once=True) as answer:
        told: dict[str, Any] = answer.value
        if "missing" in told:
            raise MissingExtraError("FBX", "fbx")
        with np.load(answer.folder / FBX_ARRAYS) as content:
            arrays = dict(content)
        worlds = None
        if "chosen" in told:
            worlds = SpilledRows(16 * len(arrays["shown"]))
            worlds.extend_from(answer.folder / FBX_FRAMES)
    return told, arrays, worlds


def _world_axes(axes: list[int], unit: float) -> NDArray[np.float64]:
    """Transform from the file's units and axes to metres, right-handed, Y up; mirrors for left-handed files.

    Args:
        axes: File axes that point right, up and to the viewer, as ufbx's numbers for x, -x, y, -y, z, -z.
        unit: The file's unit [m].
    """
    rows = np.zeros((3, 3))
    for row, axis in zip(rows, axes, strict=True):
        if axis < 6:
            row[axis // 2] = -1.0 if axis % 2 else 1.0
    out = np.eye(4)
    out[:3, :3] = rows if abs(np.linalg.det(rows)) > 0.5 else np.eye(3)
    out[:3, :3] *= unit if 0.0 < unit < _FURTHEST else 0.01
    return out


def _mesh(
    arrays: dict[str, NDArray[Any]], index: int, told: dict[str, Any], axes: NDArray[np.float64], path: Path
) -> FbxMesh:
    name, own = told["name"], {k.partition(".")[2]: v for k, v in arrays.items() if k.startswith(f"{index}.")}
    points = own["points"]
    if not (np.abs(points) < _FURTHEST).all():
        bad = int(np.argwhere(~(np.abs(points) < _FURTHEST))[0][0])
        raise InputError(f"mesh '{name}': vertex {bad} is not finite or too far away", path=path)
    if own["corners"].size and own["corners"].max() >= len(points):
        raise InputError(f"mesh '{name}': a polygon names a vertex beyond its {len(points)}", path=path)
    skin = None
    if "nodes" in own:
        for transforms in (own["binds"], own["inverses"]):
            _check(transforms, (f"cluster of mesh '{name}'",) * len(transforms), path)
        binds = axes @ own["binds"]
        skin = FbxSkin(own["nodes"], binds, own["inverses"], own["cluster"], own["vertex"], own["weight"])
    shown = own["shown"]
    _check(shown[None], (name,), path)
    uv, texture = own.get("uv"), told.get("texture", "")
    return FbxMesh(name, told["node"], points, own["counts"], own["corners"], uv, axes @ shown, skin, texture)


def _check(transforms: NDArray[np.float64], names: tuple[str, ...], path: Path) -> None:
    sane = (np.abs(transforms) < _FURTHEST).all(axis=(-1, -2))
    if not sane.all():
        node = names[int(np.argwhere(~sane)[0][-1])]
        raise InputError(f"node '{node}': its transform is not finite or too large", path=path)
