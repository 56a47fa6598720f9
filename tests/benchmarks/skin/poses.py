"""Named poses of hands and bodies. Angles in degrees; one arm, leg and hand move: the left, where there are two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.pose_sets import CURL
from warpjld.geometry.rotations import about, conjugate, multiply
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles
from warpjld.skeleton.actor import body_facing
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import poses_from_rotations

__all__ = ["POSES", "Posed", "pose"]

_FINGERS = DIGITS[:-1]
_PHALANGES = ("base", "knuckle2", "knuckle3")

Angles = dict[str, dict[str, float]]
"""Joint without its side → channel → degrees."""


@dataclass(frozen=True, eq=False)
class Posed:
    """One pose of one skeleton.

    Attributes:
        poses: Of one frame.
        bent: Joints that bend or twist, whose thickness is measured.
        limb: Joints whose segments make up the limb that is measured by itself.
    """

    poses: Poses
    bent: tuple[int, ...]
    limb: tuple[int, ...]


def _curl(amount: float, fingers: tuple[str, ...] = _FINGERS) -> Angles:
    return {f"{f}.{joint}": {"flexion": amount * full} for f in fingers for joint, full in CURL.items()}


_THUMB_OPPOSED: Angles = {"thumb.base": {"flexion": 15.0, "abduction": -22.5}}
_THUMB_IN: Angles = {"thumb.knuckle2": {"flexion": 40.0}, "thumb.knuckle3": {"flexion": 50.0}}

_BY_ANGLES: dict[str, tuple[Angles, tuple[str, ...]]] = {
    **{f"curl_{round(10 * amount):02d}": (_curl(amount), ()) for amount in (0.3, 0.6, 0.9)},
    **{f"{finger}_alone": (_curl(0.9, (finger,)), ()) for finger in _FINGERS},
    "thumb_opposed": (_THUMB_OPPOSED, ()),
    "thumb_spread": ({"thumb.base": {"abduction": 22.5}}, ()),
    "thumb_bent": ({"thumb.knuckle2": {"flexion": 55.0}, "thumb.knuckle3": {"flexion": 70.0}}, ()),
    "cupped": (
        {
            "pinky.carpometacarpal": {"flexion": 20.0},
            "ring.carpometacarpal": {"flexion": 12.0},
            **_curl(0.3),
            **_THUMB_OPPOSED,
        },
        (),
    ),
    "hook": (
        {
            f"{f}.{joint}": {"flexion": angle}
            for f in _FINGERS
            for joint, angle in zip(_PHALANGES[1:], (90.0, 60.0), strict=True)
        },
        (),
    ),
    "point": ({**_curl(0.8, ("pinky", "ring", "middle")), **_THUMB_OPPOSED, **_THUMB_IN}, ()),
    "wrist_flexed": ({"wrist": {"flexion": 60.0}}, ("elbow", "wrist")),
    "wrist_extended": ({"wrist": {"flexion": -60.0}}, ("elbow", "wrist")),
    "elbow_120": ({"elbow": {"flexion": 120.0}}, ("shoulder", "elbow")),
    "forearm_twist": ({"elbow": {"twisting": 75.0}}, ("shoulder", "elbow")),
    "knee_110": ({"knee": {"flexion": 110.0}}, ("hip", "knee")),
}
"""Name → angles, and the joints of its limb; fingers that move where that is empty."""


@dataclass(frozen=True)
class _Facing:
    up: NDArray[np.float64]
    forward: NDArray[np.float64]

    @property
    def left(self) -> NDArray[np.float64]:
        return np.cross(self.up, self.forward)


Turns = dict[str, NDArray[np.float64]]
"""Joint → its rotation relative to its parent's bone, in the axes of the rest pose, x y z w."""


def _turn(axis: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    return about(np.radians(degrees) * axis)


def _arm(sideways: bool, raised: float, clavicle: float) -> Callable[[Skeleton, _Facing], Turns]:
    """The left upper arm raised from hanging in the body's frontal or sagittal plane, whatever it rests at."""

    def turns(skeleton: Skeleton, facing: _Facing) -> Turns:
        names = skeleton.names
        along = skeleton.rest[names.index("left.elbow")] - skeleton.rest[names.index("left.shoulder")]
        rests = np.degrees(np.arctan2(along @ facing.left, -along @ facing.up))
        if sideways:
            whole = _turn(facing.forward, raised - rests)
        else:
            whole = multiply(_turn(facing.left, -raised), _turn(facing.forward, -rests))
        if not clavicle:
            return {"left.shoulder": whole}
        girdle = _turn(facing.forward, clavicle)
        return {"left.clavicle": girdle, "left.shoulder": multiply(conjugate(girdle), whole)}

    return turns


def _hip(skeleton: Skeleton, facing: _Facing) -> Turns:
    return {"left.hip": _turn(facing.left, -90.0)}


def _shared(prefixes: tuple[str, ...], degrees: float) -> Callable[[Skeleton, _Facing], Turns]:
    """A turn about the body's upright axis, in equal parts of several joints."""

    def turns(skeleton: Skeleton, facing: _Facing) -> Turns:
        joints = [n for n in skeleton.names if n.startswith(prefixes) and "." not in n]
        return {name: _turn(facing.up, degrees / len(joints)) for name in joints}

    return turns


_BY_TURNS: dict[str, tuple[Callable[[Skeleton, _Facing], Turns], tuple[str, ...]]] = {
    **{
        f"shoulder_{raised}_{'side' if sideways else 'front'}{'_clavicle' if clavicle else ''}": (
            _arm(sideways, float(raised), clavicle),
            ("clavicle", "shoulder", "elbow"),
        )
        for sideways in (True, False)
        for raised, share in ((90, 15.0), (150, 35.0))
        for clavicle in (0.0, share)
    },
    "hip_90": (_hip, ("hip", "knee")),
    "trunk_twist": (_shared(("spine",), 45.0), ("pelvis", "spine")),
    "neck_turn": (_shared(("neck", "head"), 70.0), ("neck", "head")),
}

POSES = (*_BY_ANGLES, *_BY_TURNS)
"""Names of all poses."""


def pose(name: str, skeleton: Skeleton) -> Posed | None:
    """A pose of a skeleton; None where the skeleton lacks a joint that moves in it."""
    side = "left" if any(n.startswith("left.") for n in skeleton.names) else "right"
    if name in _BY_ANGLES:
        return _by_angles(*_BY_ANGLES[name], skeleton, side)
    return _by_turns(*_BY_TURNS[name], skeleton)


def _by_angles(angles: Angles, limb: tuple[str, ...], skeleton: Skeleton, side: str) -> Posed | None:
    names = {n: j for j, n in enumerate(skeleton.names)}
    array = skeleton.initial[None].copy()
    bent = []
    for joint, channels in angles.items():
        number = names.get(f"{side}.{joint}")
        if number is None or not skeleton.children[number]:
            return None
        for channel, degrees in channels.items():
            array[0, number, CHANNELS.index(channel)] = np.radians(degrees)
        bent.append(number)
    if "wrist" in angles and skeleton.parents[bent[0]] < 0:
        return None  # a hand that begins at its wrist has no forearm to bend against: it would turn as one
    digits = {joint.partition(".")[0] for joint in angles}
    members = limb or tuple(f"{d}.{p}" for d in DIGITS if d in digits for p in _PHALANGES)
    return Posed(poses_from_angles(skeleton, array), tuple(bent), _numbers(skeleton, members))


def _by_turns(make: Callable[[Skeleton, _Facing], Turns], limb: tuple[str, ...], skeleton: Skeleton) -> Posed | None:
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    up, forward = body_facing(joints)
    if up is None or forward is None or not {"left.shoulder", "left.elbow", "left.clavicle"} <= set(joints):
        return None
    turns = make(skeleton, _Facing(up, forward))
    local = np.tile([0.0, 0.0, 0.0, 1.0], (1, len(skeleton), 1))
    bent = []
    for name, rotation in turns.items():
        bent.append(skeleton.names.index(name))
        local[0, bent[-1]] = rotation
    return Posed(poses_from_rotations(skeleton, local), tuple(bent), _numbers(skeleton, limb)) if bent else None


def _numbers(skeleton: Skeleton, members: tuple[str, ...]) -> tuple[int, ...]:
    """Joints of these names on the left side or none; those of the trunk and neck by what their names begin with."""
    side = "left" if any(n.startswith("left.") for n in skeleton.names) else "right"
    return tuple(
        j
        for j, n in enumerate(skeleton.names)
        if n.removeprefix(f"{side}.") in members or ("." not in n and n.startswith(members))
    )
