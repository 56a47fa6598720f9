"""Target shapes of a rig: poses with desired vertex positions, in a NumPy archive (``.npz``).

Arrays of the archive, F frames:

- ``vertices`` (F, W, 3) [m]: in the vertex order and frame of the rig's file, as ``warpjld deform`` writes ``.npz``
- ``channels`` (C,): names as the headings of motion CSV files, such as ``index.base.flexion`` or ``root.x``
- ``angles`` (F, C): degrees; for ``root.x``, ``root.y`` and ``root.z`` metres

The last two may be missing if a motion file of F frames gives the poses. Other arrays are ignored.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.array_file import read_arrays
from warpjld.files.reading import reading
from warpjld.motion.channels import ROOT_CHANNELS
from warpjld.motion.load import load_motion
from warpjld.motion.tracks import Motion
from warpjld.rig import Rig
from warpjld.skeleton.kinematics import Poses

__all__ = ["Targets", "read_targets"]


@dataclass(frozen=True, eq=False)
class Targets:
    """Target shapes of a rig.

    Attributes:
        poses: F poses of the rig.
        vertices: Positions of the welded vertices in these poses [m], shape (F, V, 3).
        warnings: What of a motion is not followed.
    """

    poses: Poses
    vertices: NDArray[np.float64]
    warnings: tuple[str, ...] = ()


def read_targets(path: str | Path, rig: Rig, *, motion: str | Path | None = None) -> Targets:
    """Read target shapes of a rig.

    Args:
        path: The file.
        rig: The rig.
        motion: Motion file with a pose for every shape, instead of ``channels`` and ``angles``.

    Raises:
        InputError: No such file; an array is missing, of wrong shape or not finite; an unknown joint or an angle beyond
            its limit; a number of poses other than that of shapes.
    """
    path = Path(path)
    if path.suffix.lower() != ".npz":
        raise InputError("targets: want a NumPy archive, .npz", path=path)
    arrays = read_arrays(path)
    with reading(path, "target shapes"):
        vertices = _vertices(arrays, rig)
        if motion is None:
            return Targets(_poses(arrays, len(vertices), rig), vertices)
    if "channels" in arrays or "angles" in arrays:
        raise InputError(f"has poses of its own: want no motion file beside it, got {motion}", path=path)
    loaded = load_motion(motion, rig)
    if len(loaded.poses) != len(vertices):
        raise InputError(f"has {len(loaded.poses)} frames for {len(vertices)} target shapes", path=motion)
    return Targets(loaded.poses, vertices, loaded.warnings)


def _vertices(arrays: dict[str, NDArray], rig: Rig) -> NDArray[np.float64]:
    surface = rig.surface
    count = len(surface.weld)
    array = _numbers(arrays, "vertices", f"(frames, {count}, 3)")
    if array.ndim != 3 or array.shape[1:] != (count, 3) or not len(array):
        raise InputError(f"'vertices': want shape (frames, {count}, 3), the rig's vertices, got {array.shape}")
    if not np.isfinite(array).all():
        frame, vertex, _ = np.argwhere(~np.isfinite(array))[0]
        raise InputError(f"'vertices': vertex {vertex} is not finite at frame {frame}")
    # mean over source vertices that are welded into one
    share = 1.0 / np.bincount(surface.weld, minlength=len(surface.vertices))[surface.weld]
    mean = sp.csr_array((share, (surface.weld, np.arange(count))), shape=(len(surface.vertices), count))
    return np.stack([mean @ shape for shape in array])


def _poses(arrays: dict[str, NDArray], frames: int, rig: Rig) -> Poses:
    if "channels" not in arrays:
        raise InputError("no array 'channels': want names such as index.base.flexion, or a motion file for the poses")
    channels = arrays["channels"]
    if channels.dtype.kind != "U" or channels.ndim != 1:
        raise InputError(f"'channels': want text, shape (channels,), got {channels.dtype} {channels.shape}")
    angles = _numbers(arrays, "angles", f"({frames}, {len(channels)})")
    if angles.shape != (frames, len(channels)):
        raise InputError(f"'angles': want shape ({frames}, {len(channels)}), shapes and channels, got {angles.shape}")
    named = [name.strip().lower() for name in channels.tolist()]
    if twice := [name for name in named if named.count(name) > 1]:
        raise InputError(f"'channels': '{twice[0]}' is listed twice")
    motion = Motion(span=(0.0, float(frames - 1)))
    for column, name in enumerate(named):
        moves = name in ROOT_CHANNELS
        for frame, value in enumerate(angles[:, column].tolist()):
            if not np.isfinite(value):
                raise InputError(f"'angles': {name} is not finite at frame {frame}")
            motion.set_key(name, float(frame), value if moves else float(np.radians(value)))
    return motion.poses(rig.skeleton, np.arange(frames, dtype=np.float64))


def _numbers(arrays: dict[str, NDArray], name: str, shape: str) -> NDArray[np.float64]:
    if name not in arrays:
        raise InputError(f"no array '{name}' of shape {shape}; there are {', '.join(sorted(arrays)) or 'none'}")
    if arrays[name].dtype.kind not in "iuf":
        raise InputError(f"'{name}': want numbers, got {arrays[name].dtype}")
    return np.asarray(arrays[name], dtype=np.float64)
