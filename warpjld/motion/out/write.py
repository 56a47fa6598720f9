"""Writing of poses of a rig to a motion file; the suffix determines the format."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from warpjld.errors import InputError
from warpjld.files.folders import make_folder
from warpjld.files.whole_file import whole_file

if TYPE_CHECKING:
    from warpjld.rig import Rig
    from warpjld.skeleton import Poses

__all__ = ["MOTION_OUT", "MotionWriter", "Timing", "WrittenMotion", "check_motion_out", "write_motion"]

MOTION_OUT = {
    ".bvh": "BVH: the rig's own joints, metres, Y up",
    ".glb": "binary glTF: the skinned rig with its joints animated",
    ".usd": "UsdSkel, binary: the skinned rig and a SkelAnimation, in the rig's own file's units and axes",
    ".usda": "UsdSkel as text",
    ".usdc": "UsdSkel, binary",
    ".npz": "MANO-family parameters of the rig's hands, as NumPy arrays",
}
"""Suffix → description, for help texts."""

_WRITERS = {
    ".bvh": ("bvh", "write_bvh"),
    ".glb": ("glb", "write_glb"),
    ".usd": ("usd", "write_usd"),
    ".usda": ("usd", "write_usd"),
    ".usdc": ("usd", "write_usd"),
    ".npz": ("mano", "write_mano"),
}
"""Suffix → module in this package and function, a :class:`MotionWriter`; imported when first used."""


@dataclass(frozen=True)
class Timing:
    """Frame rate and numbering, and name of the clip.

    Attributes:
        rate: Frames a second.
        start_frame: Number of the first frame, for formats that number frames.
        name: Name of the clip inside the file.
    """

    rate: float
    start_frame: int = 0
    name: str = "motion"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and self.rate > 0.0):
            raise InputError(f"rate: want frames a second, above 0, got {self.rate:g}")


@dataclass(frozen=True)
class WrittenMotion:
    """Messages about a written motion.

    Attributes:
        notes: Information for users of the file.
        warnings: What of the motion the file does not hold; every command prints them on stderr.
    """

    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


class MotionWriter(Protocol):
    """Writer of one format, to a temporary path with the right suffix."""

    def __call__(self, path: Path, rig: Rig, poses: Poses, timing: Timing) -> WrittenMotion:
        """Write all frames; the caller converts OSError."""


def check_motion_out(path: str | Path) -> None:
    """Raise what ``write_motion`` would raise for a file's name; to be called before long computations.

    Raises:
        InputError: Unknown suffix.
        MissingExtraError: The format needs an optional dependency.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        listed = "; ".join(f"{suffix} ({what})" for suffix, what in MOTION_OUT.items())
        raise InputError(f"unknown kind of motion file '{path.suffix}'; known: {listed}", path=path)
    if suffix.startswith(".usd"):
        from warpjld.io.caches import check_cache

        check_cache(path)  # needs what caches of the kind need


def write_motion(
    path: str | Path, rig: Rig, poses: Poses, *, rate: float, start_frame: int = 0, name: str | None = None
) -> WrittenMotion:
    """Write a motion on the rig's own joints; see ``MOTION_OUT`` for the suffixes.

    The file appears only when it is complete; its folder is created.

    Args:
        path: The file.
        rig: The rig.
        poses: Poses of its skeleton.
        rate: Frames a second.
        start_frame: Number of the first frame, for formats that number frames.
        name: Name of the clip inside the file; the file's stem by default.

    Raises:
        InputError: Unknown suffix, poses of another rig, or a place that cannot be written.
        MissingExtraError: The format needs an optional dependency.
    """
    path = Path(path)
    check_motion_out(path)
    timing = Timing(rate, start_frame, path.stem if name is None else name)
    module, function = _WRITERS[path.suffix.lower()]
    write: MotionWriter = getattr(import_module(f"warpjld.motion.out.{module}"), function)
    make_folder(path.parent)
    try:
        with whole_file(path) as part:
            return write(part, rig, poses, timing)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(error.message, path=path) from error
