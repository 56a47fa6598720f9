"""Reader of grasps in the format of DexGraspBench (Chen, Ke & Wang 2025): a dictionary in an ``.npy`` file.

``grasp_qpos`` holds position [m], quaternion w, x, y, z and joint angles [rad] of the hand in the world, for one grasp
or one per row; ``obj_pose`` the object's position and quaternion, ``obj_scale`` its scale, ``obj_path`` its file or
folder. Joints are named by ``joint_names`` in files that warpjld wrote, else by a joint map's ``order``.
``pregrasp_qpos`` and ``squeeze_qpos`` are ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.objects import Places
from warpjld.study.scoring.given import GivenGrasp, quaternion
from warpjld.study.scoring.reading_grasps import GraspReading, number_in

__all__ = ["dexgraspbench_grasps", "is_dexgraspbench"]

Array = NDArray[np.float64]


def is_dexgraspbench(content: Any) -> bool:
    """Whether a file's content is in this format."""
    return isinstance(content, Mapping) and "grasp_qpos" in content


def dexgraspbench_grasps(content: Mapping[str, Any], name: str, how: GraspReading) -> list[GivenGrasp]:
    """Grasps of a file's content.

    Args:
        content: The dictionary.
        name: Name of the grasp; several grasps get their row appended.
        how: Hand, joint map and other settings.

    Raises:
        InputError: Missing fields, or wrong shapes.
    """
    poses = _rows(content, "grasp_qpos", 8, more=True)
    count = len(poses)
    places = _rows(content, "obj_pose", 7, default=[0, 0, 0, 1, 0, 0, 0])
    scales = _scales(content.get("obj_scale", 1.0))
    for what, found in (("obj_pose", places), ("obj_scale", scales)):
        if len(found) not in (1, count):
            raise InputError(f"{what}: want one, or one for each of {count} grasps, got {len(found)}")
    thing = content.get("obj_path")
    if not isinstance(thing, str) or not thing:
        raise InputError("obj_path: want the object's file or folder")
    names = content.get("joint_names", [])
    if not isinstance(names, list | tuple | np.ndarray) or not all(isinstance(name, str) for name in names):
        raise InputError("joint_names: want a list of names")
    more: dict[str, Any] = {"hand": str(content.get("hand", ""))}
    more |= {key: number_in(content[key], key, above=0.0) for key in ("friction", "mass") if key in content}
    grasps = []
    for k, pose in enumerate(poses):
        called = name if count == 1 else f"{name}#{k}"
        place = places[k if len(places) > 1 else 0]
        scale = number_in(scales[k if len(scales) > 1 else 0], "obj_scale", above=0.0)
        stands = Places.of(place[:3], quaternion(place[3:], "obj_pose"))
        turn = quaternion(pose[3:7], f"{called}: grasp_qpos")
        joints = how.names.named(pose[7:].tolist(), [str(joint) for joint in names])
        grasps.append(how.posed(called, thing, pose[:3], turn, joints, place=stands, scale=scale, **more))
    return grasps


def _scales(value: Any) -> Array:
    try:
        return np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise InputError(f"obj_scale: want a number, got {str(value)[:60]!r}") from None


def _rows(
    content: Mapping[str, Any], key: str, width: int, *, default: list[int] | None = None, more: bool = False
) -> Array:
    try:
        array = np.asarray(content.get(key, default), dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if (
        array.ndim not in (1, 2)
        or not array.size
        or not (array.shape[-1] == width or (more and array.shape[-1] > width))
    ):
        wanted = f"{width} {'or more ' if more else ''}numbers, or rows of them"
        raise InputError(f"{key}: want {wanted}, got shape {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{key}: holds numbers that are not finite")
    return np.atleast_2d(array)
