"""Objects with key-framed shapes: animated surfaces from files (R94)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.array_file import read_arrays
from warpjld.files.reading import reading
from warpjld.grasp.objects import GraspObject, make_object

__all__ = ["KeyframedShape", "load_keyframes"]

_NUMBER = re.compile(r"(\d+)$")


@dataclass(frozen=True, eq=False)
class KeyframedShape:
    """An object's shapes over time.

    Attributes:
        thing: The object in its first shape.
        frames: Frame numbers, increasing, shape (F,).
        vertices: Vertices of ``thing`` at these frames [m], shape (F, n, 3).
    """

    thing: GraspObject
    frames: NDArray[np.float64]
    vertices: NDArray[np.float64]

    def at(self, frame: float) -> NDArray[np.float64]:
        """Vertices at a frame [m], shape (n, 3): linear between key frames, constant outside."""
        after = int(np.clip(np.searchsorted(self.frames, frame), 1, max(1, len(self.frames) - 1)))
        if len(self.frames) == 1:
            return np.asarray(self.vertices[0])
        part = np.clip((frame - self.frames[after - 1]) / (self.frames[after] - self.frames[after - 1]), 0.0, 1.0)
        return np.asarray((1.0 - part) * self.vertices[after - 1] + part * self.vertices[after])


def load_keyframes(path: str | Path, *, name: str | None = None, scale: float = 1.0) -> KeyframedShape:
    """Read an animated surface: an ``.npz`` as the exports write it, or the first of numbered surface files.

    After ``bag.0010.obj``, ``bag.0011.obj`` and so on are read, up to the first number that is missing.

    Args:
        path: The file.
        name: Name for messages; the file's stem if left out.
        scale: Factor on all coordinates.

    Raises:
        InputError: Unreadable, or shapes with different numbers of vertices.
    """
    from scipy.spatial import cKDTree

    path = Path(path)
    frames, vertices, faces = _archive(path) if path.suffix.lower() == ".npz" else _numbered(path)
    vertices = scale * vertices
    try:
        thing = make_object(name or path.stem, vertices[0], faces, origin=str(path))
    except InputError as error:
        raise InputError(error.message, path=path) from None
    _, kept = cKDTree(vertices[0]).query(thing.vertices)  # welding removes vertices, but moves none
    return KeyframedShape(thing, frames, np.ascontiguousarray(vertices[:, kept]))


def _archive(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    arrays = read_arrays(path)
    missing = {"vertices", "faces", "frames"} - set(arrays)
    if missing:
        raise InputError(f"no animated surface: '{sorted(missing)[0]}' is missing", path=path)
    with reading(path, "an animated surface"):
        found = (
            arrays["frames"].astype(float),
            arrays["vertices"].astype(float),
            arrays["faces"].astype(np.int64, casting="same_kind"),
        )
    frames, vertices, _ = found
    if vertices.ndim != 3 or vertices.shape[2] != 3 or frames.shape != vertices.shape[:1] or not len(frames):
        raise InputError(f"vertices: want shape (frames, n, 3), got {vertices.shape}", path=path)
    if not (np.diff(frames) > 0.0).all() or not np.isfinite(vertices).all():
        raise InputError("want increasing frames and finite vertices", path=path)
    return found


def _numbered(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    from warpjld.io.mesh_file import read_mesh

    match = _NUMBER.search(path.stem)
    if match is None:
        raise InputError("want a file with a number, as bag.0010.obj, and those that follow", path=path)
    number, width, head = int(match[1]), len(match[1]), path.stem[: match.start()]
    frames: list[float] = []
    shapes: list[NDArray[np.float64]] = []
    faces = read_mesh(path).faces
    while (now := path.with_name(f"{head}{number:0{width}d}{path.suffix}")).is_file():
        shape = read_mesh(now).vertices
        if shapes and shape.shape != shapes[0].shape:
            raise InputError(f"want {len(shapes[0])} vertices as in {path.name}, got {len(shape)}", path=now)
        frames.append(float(number))
        shapes.append(shape)
        number += 1
    return np.array(frames), np.stack(shapes), faces
