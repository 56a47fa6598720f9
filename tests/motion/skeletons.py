"""Small skeletons for the tests of motions."""

import numpy as np

from warpjld.geometry.surface import weld_surface
from warpjld.rig import Rig
from warpjld.skeleton import DIGITS, Skeleton, default_limits, hand_joint_names
from warpjld.skeleton.hand import HAND_PARENTS


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


def with_forearm(bare: Skeleton) -> Skeleton:
    """A hand on a stub of forearm, as the built-in hand is."""
    names = (bare.names[0].replace("wrist", "forearm"), *bare.names)
    return Skeleton(
        names,
        np.array([-1, *(bare.parents + 1)], dtype=np.int32),
        np.vstack([[0.0, 0.0, 0.05], bare.rest]),
        np.vstack([bare.axes[:1], bare.axes]),
        default_limits(names),
    )


def rig(skeleton: Skeleton, **fields: object) -> Rig:
    """A rig whose surface is a tetrahedron: what motions do not look at."""
    surface = weld_surface(np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    return Rig("test", skeleton, surface, **fields)  # type: ignore[arg-type]


BODY = {
    "pelvis": (None, (0.0, 1.0, 0.0)),
    "spine1": ("pelvis", (0.0, 1.1, 0.0)),
    "spine2": ("spine1", (0.0, 1.25, 0.01)),
    "spine3": ("spine2", (0.0, 1.4, 0.0)),
    "neck1": ("spine3", (0.0, 1.5, 0.0)),
    "head": ("neck1", (0.0, 1.6, 0.03)),
} | {
    f"{side}.{name}": (parent if parent in ("pelvis", "spine3") else f"{side}.{parent}", (sign * x, y, z))
    for side, sign in (("left", 1.0), ("right", -1.0))
    for name, parent, (x, y, z) in (
        ("clavicle", "spine3", (0.03, 1.4, 0.03)),
        ("shoulder", "clavicle", (0.17, 1.4, 0.0)),
        ("elbow", "shoulder", (0.35, 1.2, -0.02)),
        ("forearm twist", "elbow", (0.42, 1.1, 0.02)),
        ("wrist", "elbow", (0.5, 1.0, 0.06)),
        ("thumb.base", "wrist", (0.5, 0.97, 0.1)),
        ("thumb.knuckle2", "thumb.base", (0.49, 0.94, 0.13)),
        ("index.base", "wrist", (0.55, 0.92, 0.09)),
        ("index.knuckle2", "index.base", (0.57, 0.89, 0.1)),
        ("index.knuckle3", "index.knuckle2", (0.58, 0.87, 0.1)),
        ("index.tip", "index.knuckle3", (0.585, 0.85, 0.1)),
        ("pinky.base", "wrist", (0.57, 0.93, 0.03)),
        ("hip", "pelvis", (0.1, 0.95, 0.0)),
        ("knee", "hip", (0.13, 0.52, 0.01)),
        ("ankle", "knee", (0.15, 0.08, -0.02)),
        ("ball", "ankle", (0.17, 0.02, 0.12)),
    )
}
"""Joint → parent and place [m] of a body in A-pose."""


def body() -> Skeleton:
    """A body in A-pose, metres, Y up, facing +z."""
    names = tuple(BODY)
    parents = np.array([-1 if p is None else names.index(p) for p, _ in BODY.values()], dtype=np.int32)
    rest = np.array([place for _, place in BODY.values()])
    return Skeleton(names, parents, rest, np.tile([1.0, 0.0, 0.0], (len(names), 1)), default_limits(names))
