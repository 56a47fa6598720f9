"""Settings of the readers of grasps, and what they share: making a grasp from named angles, reading numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.study.named_angles import angles_by_name, beyond_limits
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.joint_names import JointNames

__all__ = ["GraspReading", "number_in"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GraspReading:
    """Settings for reading grasps of other programs.

    Attributes:
        hand: Function that gives the rig of a hand by its name, "" where a file names none.
        names: Joint map.
        flat_hand_mean: For MANO poses, whether zero rotations mean the flat hand; None: the file must state it.
        frames: For recordings, whether the ``last`` frame or ``all`` frames are grasps.
    """

    hand: Callable[[str], Rig]
    names: JointNames = field(default_factory=JointNames)
    flat_hand_mean: bool | None = None
    frames: str = "last"

    def posed(
        self, name: str, thing: str, position: Array, rotation: Array, joints: Mapping[str, float], **more: Any
    ) -> GivenGrasp:
        """Make a grasp from a pose of the hand frame and joint values by name.

        Args:
            name: Name of the grasp.
            thing: Name or path of the object.
            position: Position of the file's hand frame [m], shape (3,).
            rotation: Its rotation, quaternion x, y, z, w.
            joints: Joint values [rad] by the file's names.
            more: Other fields of `GivenGrasp`.

        Raises:
            InputError: Unknown joints, or numbers that are not finite.
        """
        skeleton = self.hand(more.get("hand", "")).skeleton
        try:
            angles = angles_by_name(skeleton, self.names.of_hand(joints))
        except InputError as error:
            raise InputError(f"{name}: {error.message}") from None
        if position.shape != (3,) or not np.isfinite(position).all():
            raise InputError(f"{name}: the hand's position is not three finite numbers")
        at, turn = self.names.root(position, rotation)
        beyond = beyond_limits(skeleton, angles)
        remark = f"{beyond} angles more than 1° beyond their limits" if beyond else ""
        return GivenGrasp(name, thing, at - skeleton.rest[0], turn, angles=angles, message=remark, **more)


def number_in(value: Any, what: str, *, above: float | None = None) -> float:
    """A finite number from a file, also where it was read as text (YAML reads 1e-5 as text).

    Raises:
        InputError: Not a finite number, or not above the bound.
    """
    try:
        found = float(value) if not isinstance(value, bool) else float("nan")
    except (TypeError, ValueError, OverflowError):
        found = float("nan")
    if not np.isfinite(found) or (above is not None and not found > above):
        raise InputError(
            f"{what}: want a number{'' if above is None else f' above {above:g}'}, got {str(value)[:60]!r}"
        )
    return found
