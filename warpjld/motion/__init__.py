"""Key-framed joint angles with Kochanek–Bartels interpolation (R2–R5), and import of motions from other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.runtime.lazily import lazy_names

if TYPE_CHECKING:
    from warpjld.motion.csv_file import read_csv, write_csv
    from warpjld.motion.load import MOTION_FORMATS, LoadedMotion, load_motion
    from warpjld.motion.spline import Spline
    from warpjld.motion.tracks import Clamped, Key, Limits, Motion, Track
else:
    __getattr__ = lazy_names(
        __name__,
        {
            "read_csv": "csv_file",
            "write_csv": "csv_file",
            "MOTION_FORMATS": "load",
            "LoadedMotion": "load",
            "load_motion": "load",
            "Spline": "spline",
            "Clamped": "tracks",
            "Key": "tracks",
            "Limits": "tracks",
            "Motion": "tracks",
            "Track": "tracks",
        },
    )

__all__ = [
    "MOTION_FORMATS",
    "Clamped",
    "Key",
    "Limits",
    "LoadedMotion",
    "Motion",
    "Spline",
    "Track",
    "load_motion",
    "read_csv",
    "write_csv",
]
