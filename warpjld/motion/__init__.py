"""Key-framed joint angles with Kochanek–Bartels interpolation (R2–R5), and import of motions from other programs."""

from warpjld.motion.csv_file import read_csv, write_csv
from warpjld.motion.load import MOTION_FORMATS, LoadedMotion, load_motion
from warpjld.motion.spline import Spline
from warpjld.motion.tracks import Clamped, Key, Limits, Motion, Track

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
