"""Files of hand poses: joint angles of the digits in degrees, for hands of any size and side.

    {"pose": "fist", "angles": {"index.base.flexion": 84, "index.knuckle2.flexion": 100, ...}}

Channels of the digits that a file does not name are 0. The wrist is not part of a pose.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.files.text_file import read_text
from warpjld.files.whole_file import whole_file
from warpjld.script.scene import Actor
from warpjld.skeleton import CHANNELS, DIGITS
from warpjld.suggest import one_of

__all__ = ["SHIPPED", "hand_channels", "load_pose", "save_pose", "shipped_pose"]

SHIPPED = (
    *("flat", "relaxed", "fist", "point", "pinch", "tripod"),
    *("hook", "cylinder", "sphere", "lateral", "spread", "thumb-up"),
)
"""Names of the poses that come with the package."""


_MOST = 1e6
"""Largest accepted magnitude of an angle [degrees]."""


def hand_channels(actor: Actor, side: str) -> dict[str, tuple[float, float]]:
    """Movable channels of the digits of one hand, such as ``index.base.flexion``, with their limits [degrees]."""
    found = {}
    for joint, name in enumerate(actor.skeleton.names):
        where, _, rest = name.partition(".")
        if where != side or rest.partition(".")[0] not in DIGITS:
            continue
        for column, channel in enumerate(CHANNELS):
            low, high = np.degrees(actor.skeleton.limits[joint, column])
            if low < high:
                found[f"{rest}.{channel}"] = (float(low), float(high))
    return found


def shipped_pose(name: str) -> dict[str, float]:
    """Angles [degrees] by channel of a pose that comes with the package.

    Raises:
        InputError: There is no pose of that name.
    """
    if name.lower() not in SHIPPED:
        raise InputError(f"there is no pose {name}{one_of(name.lower(), SHIPPED)}")
    source = files("warpjld.script").joinpath("poses", f"{name.lower()}.json")
    return _angles(json.loads(source.read_text(encoding="utf-8")), Path(f"{name.lower()}.json"))


def load_pose(path: Path) -> dict[str, float]:
    """Angles [degrees] by channel of a pose in a file.

    Raises:
        InputError: Not a pose file, a channel that no hand has, or an angle that is not a number.
    """
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"no pose: {error}", path=path) from error
    return _angles(content, path)


def save_pose(path: Path, angles: Mapping[str, float]) -> None:
    """Write a pose: angles [degrees] by channel."""
    rounded = {name: round(value, 2) for name, value in angles.items() if abs(value) >= 0.005}
    with whole_file(path) as part:
        part.write_text(json.dumps({"pose": path.stem, "angles": rounded}, indent=1) + "\n", encoding="utf-8")


def _angles(content: object, path: Path) -> dict[str, float]:
    """Checked angles [degrees] by channel, of a file's parsed content."""
    angles = content.get("angles") if isinstance(content, dict) else None
    if not isinstance(angles, dict):
        raise InputError('no pose: want {"angles": {"index.base.flexion": 30, ...}}', path=path)
    for name, value in angles.items():
        parts = name.split(".")
        if len(parts) != 3 or parts[0] not in DIGITS or parts[2] not in CHANNELS:
            raise InputError(f"'{name}': want digit.joint.angle, such as index.base.flexion", path=path)
        good = not isinstance(value, bool) and isinstance(value, int | float)
        if not good or not -_MOST <= value <= _MOST:
            raise InputError(f"angle of '{name}': want a number of degrees, got {value!r:.60}", path=path)
    return {name: float(value) for name, value in angles.items()}
