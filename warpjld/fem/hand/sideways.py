"""Moments of loads on digits about their axes of abduction, compared with what muscles bear sideways (R118).

Fingers are spread and squeezed together by the interossei, which are far weaker than the flexors: four fingers that
squeeze with all their strength sum up to 42.4 N, and spreading to 32.6 N (21 people; Pataky, Latash, Zatsiorsky 2008,
J. Hand Ther. 21, 377–385, PMC2637467), while gripping they do to 235 N (``fem.hand.limits``).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.limits import force_limits
from warpjld.fem.hand.muscles import knuckle_chains
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["sideways_shares"]

_OF_GRIP = 42.4 / 235.0
"""Force of a finger sideways over that of its flexors: the sums given above, shared alike by the fingers."""
_OF_PINCH = 1.0
"""The same of the thumb, whose adductor makes the key pinch: tables give it the strength of the tip pinch, or more."""


def sideways_shares(
    skeleton: Skeleton, poses: Poses, loads: BoneLoads, limits: Mapping[str, float] | None = None
) -> dict[str, float]:
    """By digit, the moment of its loads about the axis of abduction of its base over what its muscles bear; positive
    where the load resists an increase of the abduction.

    The limit acts, as that of flexion does, at the middle of the last phalanx.

    Args:
        skeleton: The rest skeleton.
        poses: Positions and rotations of its joints; the first frame counts.
        loads: Force and moment on each bone.
        limits: Digit → largest force of its flexors [N], where it differs from the default.

    Raises:
        InputError: Wrong limits.
    """
    from scipy.spatial.transform import Rotation

    allowed, out = force_limits(limits), {}
    for digit, (joints, tip) in knuckle_chains(skeleton).items():
        name, joint = digit.rpartition(".")[2], joints[0]
        beyond = np.isin(loads.bones, [*joints[1:], tip])
        force, moment = loads.force[beyond].sum(axis=0), loads.moment[beyond].sum(axis=0)
        about = moment - np.cross(poses.positions[0, joint], force)
        # as flexion's, the axis turns with the parent bone
        before = max(int(skeleton.parents[joint]), 0)
        axis = Rotation.from_quat(poses.rotations[0, before]).apply(skeleton.mirror[joint] * skeleton.normals[joint])
        pad = 0.5 * (skeleton.rest[joints[-1]] + skeleton.rest[tip])
        strength = allowed[name] * (_OF_PINCH if name == "thumb" else _OF_GRIP)
        out[digit] = -float(about @ axis) / (strength * float(np.linalg.norm(pad - skeleton.rest[joint])))
    return out
