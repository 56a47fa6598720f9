"""Alignment of MANO's axes and rest hand with a rig's hand, used to convert MANO's rotations in both directions.

MANO (Romero, Tzionas & Black 2017), and the hands of SMPL-H and SMPL-X, are flat at rest, as the hands of a body in
T-pose that faces +z: fingers of the right hand point to -x, those of the left to +x, the back of the hand to +y and the
thumb to +z. Every joint's rotation is an axis-angle vector [rad] in these axes, relative to its parent; so the right
fingers curl about +z and the left about -z. Bone lengths and joint positions belong to the licensed model and are not
needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.geometry.rotations import minimal_rotation, multiply, rotate, unit
from warpjld.motion.hand_motion import IDENTITY, hand_joints
from warpjld.skeleton import Skeleton
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.recognise.hand_frame import hand_frame

__all__ = ["MANO_DIGITS", "MANO_JOINTS", "ManoRest", "mano_rest"]

MANO_DIGITS = ("index", "middle", "pinky", "ring", "thumb")
"""MANO's order of the digits."""
MANO_JOINTS = tuple(f"{digit}{k}" for digit in MANO_DIGITS for k in (1, 2, 3))

_FLAT = np.cos(np.radians(20.0))
"""Largest deviation at which a digit of the rig counts as flat: MANO's own bones deviate by up to 15°."""
_ALONG_AXES = np.radians(10.0)
"""A hand this close to the coordinate axes is taken as aligned: knuckles do not define directions more exactly."""


@dataclass(frozen=True, eq=False)
class ManoRest:
    """Alignment of MANO's rest hand with a rig's.

    Attributes:
        axes: Rotation of MANO's axes into the rig's, for the hand at rest, shape (4,).
        joints: The rig's joint for each of MANO's fifteen, -1 for missing ones.
        align: Rotation of each of these joints' bones from the rig's rest to the flat hand, shape (15, 4).
    """

    axes: NDArray[np.float64]
    joints: tuple[int, ...]
    align: NDArray[np.float64]


def mano_rest(skeleton: Skeleton, side: str) -> ManoRest:
    """Align MANO's rest hand with a rig's: palms coincide; each finger is straight in the palm's plane, where the rig's
    points.

    The thumb lies in that plane, too, at 45° to the fingers. Digits that rest within 20° of this are left unchanged.

    Raises:
        InputError: The rig's hand has no palm.
    """
    own = hand_joints(skeleton, side)
    needed = ("wrist", "index.base", "middle.base", "pinky.base")
    if missing := [name for name in needed if name not in own]:
        raise InputError(f"the rig's {side} hand has no {', '.join(missing)}: MANO's palm cannot be laid upon it")
    points = {name: skeleton.rest[j] for name, j in own.items()}
    forward = unit(points["middle.base"] - points["wrist"])
    dorsal = hand_frame(points, side).dorsal
    dorsal = unit(dorsal - forward * (forward @ dorsal))
    radial = np.cross(dorsal, forward) if side == "right" else np.cross(forward, dorsal)
    across = -1.0 if side == "right" else 1.0
    axes = Rotation.from_matrix(np.column_stack([across * forward, dorsal, radial]))
    group = Rotation.create_group("O")
    off = (group.inv() * axes).magnitude()
    if off.min() < _ALONG_AXES:
        axes = group[int(off.argmin())]
    x, dorsal, radial = axes.as_matrix().T
    forward = across * x
    joints: list[int] = []
    align = np.tile(IDENTITY, (len(MANO_JOINTS), 1))
    for d, digit in enumerate(MANO_DIGITS):
        chain = [own.get(f"{digit}.{joint}", -1) for joint in FINGER_JOINTS]
        joints += chain[:3]
        bones = [skeleton.rest[b] - skeleton.rest[a] if min(a, b) >= 0 else np.zeros(3) for a, b in pairwise(chain)]
        if digit == "thumb":
            flat = unit(forward + radial)
        else:
            flat = unit(bones[0] - dorsal * (dorsal @ bones[0]))
            flat = flat if flat @ forward > 0.5 else forward
        if all(unit(bone) @ flat > _FLAT for bone in bones if np.any(bone)):
            continue
        turned = IDENTITY
        for k, bone in enumerate(bones):
            if np.any(bone):
                turned = multiply(minimal_rotation(rotate(turned, bone), flat), turned)
            align[3 * d + k] = turned
    return ManoRest(np.asarray(axes.as_quat()), tuple(joints), align)
