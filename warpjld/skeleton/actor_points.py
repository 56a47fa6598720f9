"""Names of the 87-point actor skeleton (B §2.1, R12), the parent of each point, and its canonical joint.

The papers give the number of points, not the points. Here: two hands of 25 points (wrists included), 11 points of trunk
and head, 4 per arm, 9 per leg: 50 + 11 + 8 + 18 = 87.
"""

from __future__ import annotations

from collections.abc import Collection

from warpjld.skeleton.hand import HAND_PARENTS, hand_joint_names

__all__ = ["ACTOR_PARENTS", "ACTOR_POINTS", "CANONICAL", "NO_ARTICULATION", "POINT_JOINTS", "point_set"]

_SIDES = ("left", "right")

_TRUNK = {
    "pelvis": "where spine and legs meet",
    "vertebra1": "lowest of five joints of the spine",
    "vertebra2": "second",
    "vertebra3": "third",
    "vertebra4": "fourth",
    "vertebra5": "fifth: the lowest of the neck where the trunk has four",
    "skull_base": "where the head turns",
    "head_top": "extremity of the head: the centre of its round top",
    "chin": "foremost point of the midline below the lips",
    "nose_tip": "foremost point of the head",
    "sternum": "between the inner ends of the clavicles",
}
_ARM = {
    "clavicle": "its inner end",
    "shoulder": "head of the humerus",
    "elbow": "joint",
    "forearm_twist": "middle of the forearm, about which it twists",
}
_LEG = {
    "pelvic_hip": "hip bone: half-way from the pelvis to the head of the femur",
    "femoral_head": "hip joint",
    "knee": "joint",
    "ankle": "joint",
    "heel": "centre of the heel",
    "ball": "ball of the foot: among the bases of the toes",
    "big_toe_tip": "extremity",
    "middle_toe_tip": "extremity",
    "little_toe_tip": "extremity",
}

ACTOR_POINTS: dict[str, str] = (
    {name: f"hand joint, {side}" for side in _SIDES for name in hand_joint_names(side)}
    | _TRUNK
    | {f"{side}.{name}": what for side in _SIDES for name, what in (_ARM | _LEG).items()}
)
"""The 87 points and what each one is; hand points have the names of the hands' joints."""

_TRUNK_PARENTS = {
    "pelvis": None,
    "vertebra1": "pelvis",
    "vertebra2": "vertebra1",
    "vertebra3": "vertebra2",
    "vertebra4": "vertebra3",
    "vertebra5": "vertebra4",
    "skull_base": "vertebra5",
    "head_top": "skull_base",
    "chin": "skull_base",
    "nose_tip": "skull_base",
    "sternum": "vertebra4",
}
_LIMB_PARENTS = {
    "clavicle": "shoulder girdle",
    "shoulder": "clavicle",
    "elbow": "shoulder",
    "forearm_twist": "elbow",
    "wrist": "forearm_twist",
    "pelvic_hip": "pelvis",
    "femoral_head": "pelvic_hip",
    "knee": "femoral_head",
    "ankle": "knee",
    "heel": "ankle",
    "ball": "ankle",
    "big_toe_tip": "ball",
    "middle_toe_tip": "ball",
    "little_toe_tip": "ball",
}


def _parent(side: str, name: str) -> str:
    above = HAND_PARENTS.get(name) or _LIMB_PARENTS[name]
    return {"shoulder girdle": "sternum", "pelvis": "pelvis"}.get(above, f"{side}.{above}")


ACTOR_PARENTS: dict[str, str | None] = {
    name: _TRUNK_PARENTS[name] if name in _TRUNK_PARENTS else _parent(*name.split(".", 1)) for name in ACTOR_POINTS
}
"""Point → parent point; None for the root."""

_CANONICAL_NAMES = {
    "vertebra1": "spine1",
    "vertebra2": "spine2",
    "vertebra3": "spine3",
    "vertebra4": "spine4",
    "vertebra5": "neck1",
    "skull_base": "head",
    "head_top": "head.top",
    "femoral_head": "hip",
    "big_toe_tip": "toe1.tip",
    "middle_toe_tip": "toe3.tip",
    "little_toe_tip": "toe5.tip",
}


def _canonical(name: str) -> str:
    side, dot, short = name.partition(".")
    return f"{side}.{_CANONICAL_NAMES.get(short, short)}" if dot else _CANONICAL_NAMES.get(name, name)


CANONICAL: dict[str, str] = {name: _canonical(name) for name in ACTOR_POINTS}
"""Point → canonical joint; points without a joint that bends (chin, heel, …) are joints of the same name."""

_LEAVES = ("chin", "nose_tip", "sternum", "pelvic_hip", "heel")
POINT_JOINTS: tuple[str, ...] = tuple(
    dict.fromkeys(CANONICAL[name] for name in ACTOR_POINTS if name.rpartition(".")[2] in (*_LEAVES, "forearm_twist"))
)
"""Canonical joints that exist only in an actor skeleton; no joint naming convention has them."""

NO_ARTICULATION: tuple[str, ...] = _LEAVES
"""Points, without their side, that are no articulation."""


def point_set(names: Collection[str]) -> tuple[str, ...]:
    """The point set that names belong to: the 25 of one hand if all of them are that hand's, else all 87."""
    for side in _SIDES:
        hand = hand_joint_names(side)
        if names and set(names) <= set(hand):
            return hand
    return tuple(ACTOR_POINTS)
