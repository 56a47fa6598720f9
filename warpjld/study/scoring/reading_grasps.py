"""What readers of grasps need to know besides the file."""

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
    """How grasps of others are read.

    Attributes:
        hand: The rig of a hand by its name; "" for a file that names none.
        names: Which angle of the hand each of their joints is.
        flat_hand_mean: Whether no rotation means the flat hand, for MANO poses; None where the file must say.
        frames: Of recordings, whether the last frame is the grasp, or each of them.
    """

    hand: Callable[[str], Rig]
    names: JointNames = field(default_factory=JointNames)
    flat_hand_mean: bool | None = None
    frames: str = "last"

    def posed(
        self, name: str, thing: str, position: Array, rotation: Array, joints: Mapping[str, float], **more: Any
    ) -> GivenGrasp:
        """A grasp of a hand's pose and named angles.

        Args:
            name: What the file calls it.
            thing: The object.
            position: Of the file's frame of the hand [m], shape (3,).
            rotation: Likewise, quaternion x, y, z, w.
            joints: Angle of each joint [rad].
            more: Other fields of `GivenGrasp`.

        Raises:
            InputError: Joints that are none of the hand's, or numbers that are none.
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
        said = f"{beyond} angles more than 1° beyond their limits" if beyond else ""
        return GivenGrasp(name, thing, at - skeleton.rest[0], turn, angles=angles, message=said, **more)


def number_in(value: Any, what: str, *, above: float | None = None) -> float:
    """A finite number of a file, which may write it as text as YAML does with 1e-5.

    Raises:
        InputError: It is none, or not above the bound.
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
