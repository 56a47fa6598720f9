"""Reader of grasps of NVIDIA Isaac Sim and Isaac ROS: ``isaac_grasp`` YAML, version 1.0.

A file holds grasps of one gripper and one object: the gripper's pose in the object's frame [m], and named joints
[rad]. Files that warpjld wrote also have hand, object, scale, mass and friction below the key ``warpjld``; in others
the object is the last part of the path in ``object_frame_link`` (Isaac ROS: ``object_frame``).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError, MissingExtraError
from warpjld.files.reading import reading
from warpjld.files.text_file import read_text
from warpjld.study.scoring.given import GivenGrasp, quaternion
from warpjld.study.scoring.reading_grasps import GraspReading, number_in

__all__ = ["read_isaac"]


def read_isaac(path: Path, how: GraspReading) -> list[GivenGrasp]:
    """Read the grasps of a file.

    Raises:
        InputError: Not such a file, another version, or a grasp that cannot be used; names the grasp.
        MissingExtraError: PyYAML is not installed.
    """
    content = _loaded(path)
    if content.get("format") != "isaac_grasp":
        raise InputError("want format: isaac_grasp", path=path)
    if number_in(content.get("format_version"), "format_version") != 1.0:
        raise InputError(f"isaac_grasp version {content['format_version']} is not read; want 1.0", path=path)
    own = content.get("warpjld")
    own = own if isinstance(own, Mapping) else {}
    frame = content.get("object_frame_link", content.get("object_frame", ""))
    thing = str(own.get("object", str(frame).rstrip("/").rpartition("/")[2]))
    frictions = own.get("friction") if isinstance(own.get("friction"), Mapping) else {}
    same: dict[str, Any] = {
        "hand": str(own.get("hand", "")),
        "scale": number_in(own.get("scale", 1.0), "scale", above=0.0),
    }
    if "mass" in own:
        same["mass"] = number_in(own["mass"], "mass", above=0.0)
    grasps = content.get("grasps")
    if not isinstance(grasps, Mapping) or not grasps:
        raise InputError("has no grasps", path=path)
    found = []
    try:
        for name, grasp in grasps.items():
            more = dict(same)
            if isinstance(frictions, Mapping) and name in frictions:
                more["friction"] = number_in(frictions[name], f"friction.{name}", above=0.0)
            found.append(_grasp(str(name), grasp, thing, how, more))
    except InputError as error:
        raise InputError(error.message, path=path) from None
    return found


def _loaded(path: Path) -> Mapping[str, Any]:
    try:
        import yaml
    except ImportError:
        raise MissingExtraError("reading isaac_grasp YAML", "grasps") from None
    text = read_text(path)
    with reading(path, "YAML"):
        content = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))  # creates plain values only
    if not isinstance(content, Mapping):
        raise InputError("want format: isaac_grasp", path=path)
    return content


def _grasp(name: str, grasp: Any, thing: str, how: GraspReading, more: dict[str, Any]) -> GivenGrasp:
    if not isinstance(grasp, Mapping):
        raise InputError(f"{name}: want position, orientation and cspace_position")
    turn, joints = grasp.get("orientation"), grasp.get("cspace_position")
    place = grasp.get("position")
    if not isinstance(place, list) or len(place) != 3:
        raise InputError(f"{name}: position: want three numbers")
    if not isinstance(turn, Mapping) or not isinstance(turn.get("xyz"), list) or "w" not in turn:
        raise InputError(f"{name}: orientation: want w and xyz")
    if not isinstance(joints, Mapping):
        raise InputError(f"{name}: cspace_position: want joints by name")
    position = np.array([number_in(value, f"{name}: position") for value in place])
    parts = [number_in(value, f"{name}: orientation") for value in (turn["w"], *turn["xyz"])]
    angles = {str(joint): number_in(value, f"{name}: {joint}") for joint, value in joints.items()}
    return how.posed(name, thing, position, quaternion(np.array(parts), f"{name}: orientation"), angles, **more)
