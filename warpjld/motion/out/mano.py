"""Writer of MANO parameters of a rig's hands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.files.array_archive import ArrayArchive
from warpjld.files.spilled_rows import SpilledRows
from warpjld.geometry.rotations import conjugate, multiply
from warpjld.motion.hand_motion import IDENTITY
from warpjld.motion.mano_rest import MANO_DIGITS, MANO_JOINTS, mano_rest
from warpjld.motion.out.write import Timing, WrittenMotion
from warpjld.rig import Rig
from warpjld.skeleton import Poses, Skeleton
from warpjld.skeleton.streamed_poses import blocks_of

__all__ = ["hand_parameters", "write_mano"]

_FIELDS = {"global_orient": 3, "hand_pose": 45, "transl": 3}
"""Field of a hand → count of numbers a frame."""


def write_mano(path: Path, rig: Rig, poses: Poses, timing: Timing) -> WrittenMotion:
    """Write a hand's motion as MANO-family parameters; a :class:`~warpjld.motion.out.write.MotionWriter`.

    Fields: ``global_orient`` (F, 3) and ``hand_pose`` (F, 45), axis-angle [rad]; ``transl`` (F, 3), the wrist's
    position [m]; ``joint_order`` (15 names), ``side``, ``fps``, ``flat_hand_mean`` (true: zero rotations are the flat
    hand) and ``frame``, "rig": orientation and position are in the rig's own axes. For a rig with two hands the first
    three are prefixed with ``left_`` and ``right_``, and ``side`` is missing. MANO adds its ``transl`` to the wrist of
    its template, which belongs to the licensed model: subtract that. Joints missing in the rig do not rotate.

    Raises:
        InputError: The rig has no hand.
    """
    sides = [side for side in ("left", "right") if f"{side}.wrist" in rig.skeleton.names]
    if not sides:
        raise InputError("MANO parameters are those of a hand: this rig has none")
    # an archive holds one array after the other, so that what is computed together lies in a file in between
    rows = {side: SpilledRows(sum(_FIELDS.values())) for side in sides}
    for _, some in blocks_of(poses):
        for side in sides:
            fields = hand_parameters(rig.skeleton, some, side)
            rows[side].extend(np.concatenate([fields[name] for name in _FIELDS], axis=1))
    with ArrayArchive(path) as archive:
        archive.add("joint_order", MANO_JOINTS)
        archive.add("fps", float(timing.rate))
        archive.add("flat_hand_mean", True)
        archive.add("frame", "rig")
        if len(sides) == 1:
            archive.add("side", sides[0])
        for side in sides:
            first = 0
            for name, width in _FIELDS.items():
                archive.begin(f"{side}_{name}" if len(sides) > 1 else name, (len(poses), width), np.float64)
                for block in rows[side].blocks():
                    archive.extend(np.ascontiguousarray(block[:, first : first + width]))
                first += width
    return WrittenMotion(("MANO's axis-angles from the flat hand; metacarpals, which MANO has not, in the fingers'",))


def hand_parameters(skeleton: Skeleton, poses: Poses, side: str) -> dict[str, NDArray[np.float64]]:
    """``global_orient``, ``hand_pose`` and ``transl`` of one hand.

    With Q the rotation of a bone relative to the wrist, and W and A as in ``ManoTrack.turns``, the bone's rotation from
    the flat hand is R = Wᵀ Q A⁻¹ W. MANO has no mobile metacarpals: their rotations are included in the fingers'.
    """
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
    return {
        "global_orient": Rotation.from_quat(orient).as_rotvec(),
        "hand_pose": Rotation.from_quat(local.reshape(-1, 4)).as_rotvec().reshape(len(poses), 45),
        "transl": poses.positions[:, wrist],
    }
