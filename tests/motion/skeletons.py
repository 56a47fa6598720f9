"""Small skeletons for the tests of motions."""

import numpy as np

from warpjld.rig import Rig
from warpjld.skeleton import DIGITS, Skeleton, default_limits, hand_joint_names
from warpjld.skeleton.hand import HAND_PARENTS
from warpjld.surface import weld_surface


def hand(side: str = "left") -> Skeleton:
    """A flat hand, fingers along -z, dorsal side up (+y), thumb at +x on the left (palm down) and -x on the right."""
    sign = 1.0 if side == "left" else -1.0
    rest = [(0.0, 0.0, 0.0)]
    for name in list(HAND_PARENTS)[1:]:
        digit, joint = name.split(".")
        across = (DIGITS.index(digit) - 2) * 0.02
        if digit == "thumb":
            along = {"base": 0.02, "knuckle2": 0.055, "knuckle3": 0.085, "tip": 0.11}[joint]
            rest.append((sign * (0.02 + 0.6 * along), -0.3 * along, -0.7 * along))
        else:
            along = {"carpometacarpal": 0.02, "base": 0.09, "knuckle2": 0.13, "knuckle3": 0.155, "tip": 0.18}[joint]
            rest.append((sign * across * min(along / 0.09, 1.0), 0.0, -along))
    names = hand_joint_names(side)
    bare = list(HAND_PARENTS)
    parents = np.array([-1 if p is None else bare.index(p) for p in HAND_PARENTS.values()], dtype=np.int32)
    axes = np.tile([-1.0, 0.0, 0.0], (len(names), 1))
    return Skeleton(names, parents, np.array(rest), axes, default_limits(names))


def rig(skeleton: Skeleton, **fields: object) -> Rig:
    """A rig whose surface is a tetrahedron: what motions do not look at."""
    surface = weld_surface(np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    return Rig("test", skeleton, surface, **fields)  # type: ignore[arg-type]
