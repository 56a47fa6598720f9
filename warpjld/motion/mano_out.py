"""Poses of a rig's hand → MANO's parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.motion.hand_motion import IDENTITY
from warpjld.motion.mano_rest import MANO_DIGITS, MANO_JOINTS, mano_rest
from warpjld.rotations import conjugate, multiply
from warpjld.skeleton import Poses, Skeleton
from warpjld.whole_file import whole_file

__all__ = ["write_mano"]


def write_mano(path: str | Path, skeleton: Skeleton, poses: Poses, rate: float, side: str | None = None) -> None:
    """Write a hand's motion as an ``.npz`` file of MANO-family parameters.

    Fields: ``global_orient`` (F, 3) and ``hand_pose`` (F, 45), axis-angle [rad]; ``transl`` (F, 3), where the wrist is
    [m]; ``joint_order`` (15 names), ``side``, ``fps``, ``flat_hand_mean`` (true: no rotation is the flat hand) and
    ``frame``, "rig": orientation and place are in the rig's own axes. MANO's ``transl`` adds to the place of its wrist
    in its template, which is the licensed model's: subtract it. With Q the rotation of a bone relative to the wrist,
    W and A as in ``ManoTrack.turns``, the bone's rotation from the flat hand is R = Wᵀ Q A⁻¹ W; MANO has no moving
    metacarpals, so that theirs is in the fingers'. Joints that the rig lacks do not turn.

    Args:
        path: The file, ``.npz``.
        skeleton: The rig's skeleton.
        poses: Its poses.
        rate: Frames a second.
        side: Which hand; may be left out where the rig has one.

    Raises:
        InputError: The rig has no such hand, or two and no side is given, or another suffix.
    """
    path = Path(path)
    if path.suffix.lower() != ".npz":
        raise InputError("MANO parameters are written as .npz", path=path)
    own = [one for one in ("left", "right") if f"{one}.wrist" in skeleton.names]
    if side is None and len(own) == 1:
        side = own[0]
    if side not in own:
        have = " and ".join(own) or "no"
        raise InputError(f"side: want one that the rig has ({have} hand), got {side}", path=path)
    rest = mano_rest(skeleton, side)
    wrist = skeleton.index(f"{side}.wrist")
    back = conjugate(poses.rotations[:, wrist])
    local = np.tile(IDENTITY, (len(poses), len(MANO_JOINTS), 1))
    for d in range(len(MANO_DIGITS)):
        before = np.tile(IDENTITY, (len(poses), 1))
        for m in range(3 * d, 3 * d + 3):
            if rest.joints[m] < 0:
                continue
            bone = multiply(multiply(back, poses.rotations[:, rest.joints[m]]), conjugate(rest.align[m]))
            world = multiply(multiply(conjugate(rest.axes), bone), rest.axes)
            local[:, m] = multiply(conjugate(before), world)
            before = world
    orient = multiply(poses.rotations[:, wrist], rest.axes)
    fields = {
        "global_orient": Rotation.from_quat(orient).as_rotvec(),
        "hand_pose": Rotation.from_quat(local.reshape(-1, 4)).as_rotvec().reshape(len(poses), 45),
        "transl": poses.positions[:, wrist],
        "joint_order": np.array(MANO_JOINTS),
        "side": np.array(side),
        "fps": np.array(float(rate)),
        "flat_hand_mean": np.array(True),
        "frame": np.array("rig"),
    }
    with whole_file(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **fields)
