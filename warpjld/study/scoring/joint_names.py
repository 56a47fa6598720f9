"""Joint map for grasps from other programs: the hand's angle for each of their joints, and their hand frame.

::

    {
      "joints": {
        "FFJ3": "index.base.flexion",
        "FFJ4": {"channel": "index.base.abduction", "factor": -1, "offset": 5},
        "WRJ1": null
      },
      "order": ["WRJ1", "FFJ4", "FFJ3"],
      "hand_frame": {"position": [0, 0, 0.01], "rotation": [1, 0, 0, 0]}
    }

The hand's angle is factor × joint + offset [°]; null ignores a joint. ``order`` names the joints of files in which
they are only numbered. ``hand_frame`` is the pose of the rig's root joint at rest, with the axes of the rig's file, in
the hand frame of the grasps: metres, and a quaternion w, x, y, z.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.text_file import read_json
from warpjld.geometry.rotations import multiply, rotate

__all__ = ["JointNames", "read_joint_names"]

Array = NDArray[np.float64]

_KEYS = ("joints", "order", "hand_frame")


@dataclass(frozen=True)
class _Angle:
    """The hand's angle for a joint: factor × joint + offset [rad]."""

    channel: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class JointNames:
    """A joint map. The default one is for files with the hand's own joint names and frame.

    Attributes:
        joints: Angle of the hand by the file's joint name; None for joints that are ignored.
        order: Joint names, in the order of files that only number them.
        position: Position of the rig's root in the file's hand frame [m], shape (3,).
        rotation: Rotation of the rig's axes in that frame, quaternion x, y, z, w, shape (4,).
    """

    joints: Mapping[str, _Angle | None] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))

    def named(self, values: Sequence[float], names: Sequence[str]) -> dict[str, float]:
        """Values by joint name: the file's names, or those of ``order``.

        Raises:
            InputError: There are no names, or not as many as values.
        """
        called = list(names) or list(self.order)
        if not called:
            raise InputError(
                f'has {len(values)} joints without names: state their order in a joint map ("order"), with the angle '
                "of the hand that each of them is"
            )
        if len(called) != len(values):
            raise InputError(f"has {len(values)} joints, and {len(called)} names of joints")
        if len(set(called)) != len(called):
            raise InputError(f"two joints are called '{next(n for n in called if called.count(n) > 1)}'")
        return dict(zip(called, map(float, values), strict=True))

    def of_hand(self, values: Mapping[str, float]) -> dict[str, float]:
        """Angles of the hand [rad] by name, from the file's joint values; names not in the map are kept.

        Raises:
            InputError: Two joints for one angle.
        """
        out: dict[str, float] = {}
        for name, value in values.items():
            angle = self.joints.get(name, _Angle(name))
            if angle is None:
                continue
            if angle.channel in out:
                raise InputError(f"joint map: two joints are {angle.channel}; '{name}' is the second")
            out[angle.channel] = angle.factor * value + angle.offset
        return out

    def root(self, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Pose of the rig's root, (3,) [m] and (4,), from that of the file's hand frame."""
        return position + rotate(rotation, self.position), np.asarray(multiply(rotation, self.rotation))


def read_joint_names(path: str | Path) -> JointNames:
    """Read a joint map for grasps (JSON).

    Raises:
        InputError: It cannot be read, or is not a joint map.
    """
    content = read_json(path)
    if not isinstance(content, dict) or not content.keys() <= set(_KEYS) or "joints" not in content:
        raise InputError(f'want {{"joints": {{…}}}}, with {", ".join(_KEYS[1:])} where needed', path=path)
    try:
        joints, order = content["joints"], content.get("order", [])
        if not isinstance(joints, dict):
            raise InputError("joints: want an object of names")
        if not isinstance(order, list) or not all(isinstance(name, str) for name in order):
            raise InputError("order: want a list of names")
        angles = {name: _angle(name, value) for name, value in joints.items()}
        return JointNames(angles, tuple(order), *_frame(content.get("hand_frame", {})))
    except InputError as error:
        raise InputError(error.message, path=path) from None


def _angle(name: str, value: Any) -> _Angle | None:
    if value is None:
        return None
    if isinstance(value, str):
        return _Angle(value)
    if not isinstance(value, dict) or not isinstance(value.get("channel"), str):
        raise InputError(f"joints.{name}: want null, an angle such as index.base.flexion, or an object with a channel")
    if strange := value.keys() - {"channel", "factor", "offset"}:
        raise InputError(f"joints.{name}: there is no '{min(strange)}'; want channel, factor, offset")
    factor, offset = (_number(f"joints.{name}.{key}", value.get(key, default)) for key, default in
                      (("factor", 1.0), ("offset", 0.0)))  # fmt: skip
    return _Angle(value["channel"], factor, float(np.radians(offset)))


def _frame(value: Any) -> tuple[Array, Array]:
    if not isinstance(value, dict) or not value.keys() <= {"position", "rotation"}:
        raise InputError("hand_frame: want position [x, y, z] and rotation [w, x, y, z]")
    position = _numbers("hand_frame.position", value.get("position", [0, 0, 0]), 3)
    turn = _numbers("hand_frame.rotation", value.get("rotation", [1, 0, 0, 0]), 4)[[1, 2, 3, 0]]
    if not (length := float(np.linalg.norm(turn))) > 1e-9:
        raise InputError("hand_frame.rotation: has no length")
    return position, turn / length


def _numbers(what: str, value: Any, count: int) -> Array:
    if not isinstance(value, list) or len(value) != count:
        raise InputError(f"{what}: want {count} numbers")
    return np.array([_number(what, number) for number in value])


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{what}: want a number, got {value!r}")
    return float(value)
