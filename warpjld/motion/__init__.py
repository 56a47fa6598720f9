"""Keys and Kochanek–Bartels in-betweens of joint angles (R2–R5), and motions of other programs."""

from warpjld.motion.csv_file import read_csv, write_csv
from warpjld.motion.spline import Spline
from warpjld.motion.tracks import Clamped, Key, Limits, Motion, Track

__all__ = ["Clamped", "Key", "Limits", "Motion", "Spline", "Track", "read_csv", "write_csv"]
