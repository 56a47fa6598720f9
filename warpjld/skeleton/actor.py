"""The 87-point actor skeleton of a body (B §2.1, R12), from its joints and, for points without a joint, its surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.actor_points import ACTOR_POINTS, CANONICAL
from warpjld.skeleton.hand import hand_joint_names
from warpjld.skeleton.recognise.axes import perpendicular
from warpjld.skeleton.recognise.extremity import find_extremity
from warpjld.skeleton.recognise.section import nearby
from warpjld.skeleton.tree import Skeleton

__all__ = ["ACTOR_POINTS", "ActorSkeleton", "actor_skeleton", "body_facing", "face_points", "hand_points"]


@dataclass(frozen=True, eq=False)
class ActorSkeleton:
    """Points of the actor skeleton that a rig holds.

    Attributes:
        points: Names of ``ACTOR_POINTS`` → positions [m].
        missing: Names that could not be placed.
    """

    points: dict[str, NDArray[np.float64]]
    missing: tuple[str, ...]


def actor_skeleton(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> ActorSkeleton:
    """Place the 87 points in a body.

    Args:
        skeleton: A body's canonical skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).

    Raises:
        InputError: The skeleton is not a body's.
    """
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    if "pelvis" not in joints:
        raise InputError("an actor skeleton needs a body: this skeleton has no pelvis")
    points = {name: joints[name] for side in ("left", "right") for name in hand_joint_names(side) if name in joints}
    points |= dict(_trunk(joints))
    points |= dict(_arms(joints))
    points |= dict(_legs(joints))
    up, forward = body_facing(joints)
    if up is not None and forward is not None:
        points |= dict(_face(joints, vertices, up, forward))
        points |= dict(_heels(joints, vertices, faces, forward))
    # a joint of the skeleton with a point's own name overrides the position derived from others
    points |= {name: joints[own] for name, own in CANONICAL.items() if own in joints and own not in _NUMBERED}
    if all(own in joints for own in _NUMBERED):
        points |= {name: joints[own] for name, own in CANONICAL.items() if own in _NUMBERED}
    ordered = {name: points[name] for name in ACTOR_POINTS if name in points}
    return ActorSkeleton(ordered, tuple(name for name in ACTOR_POINTS if name not in points))


def hand_points(skeleton: Skeleton) -> ActorSkeleton:
    """The 25 points of each hand of a skeleton that has no body.

    Raises:
        InputError: The skeleton has no hand.
    """
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    sides = [side for side in ("left", "right") if f"{side}.index.base" in joints]
    if not sides:
        raise InputError("named points need a body or a hand: this skeleton has neither")
    wanted = [name for side in sides for name in hand_joint_names(side)]
    return ActorSkeleton(
        {name: joints[name] for name in wanted if name in joints}, tuple(n for n in wanted if n not in joints)
    )


_SKIN_DEPTH = 0.06  # depth of nose and chin inside the skin, per height from skull base to crown; about 1 cm
_NUMBERED = tuple(own for name, own in CANONICAL.items() if name.startswith("vertebra"))

Joints = dict[str, NDArray[np.float64]]
Placed = Iterator[tuple[str, NDArray[np.float64]]]


def _trunk(joints: Joints) -> Placed:
    column = [*(n for n in joints if n[:5] == "spine"), *(n for n in joints if n[:4] == "neck")]
    for n, name in enumerate(column[:5], start=1):
        yield f"vertebra{n}", joints[name]
    for point, name in (("pelvis", "pelvis"), ("skull_base", "head"), ("head_top", "head.top")):
        if name in joints:
            yield point, joints[name]
    if "left.clavicle" in joints and "right.clavicle" in joints:
        yield "sternum", (joints["left.clavicle"] + joints["right.clavicle"]) / 2


def _arms(joints: Joints) -> Placed:
    for side in ("left", "right"):
        for name in ("clavicle", "shoulder", "elbow"):
            if f"{side}.{name}" in joints:
                yield f"{side}.{name}", joints[f"{side}.{name}"]
        if f"{side}.elbow" in joints and f"{side}.wrist" in joints:
            yield f"{side}.forearm_twist", (joints[f"{side}.elbow"] + joints[f"{side}.wrist"]) / 2


def _legs(joints: Joints) -> Placed:
    for side in ("left", "right"):
        if f"{side}.hip" in joints:
            yield f"{side}.femoral_head", joints[f"{side}.hip"]
            yield f"{side}.pelvic_hip", (joints["pelvis"] + joints[f"{side}.hip"]) / 2
        for name in ("knee", "ankle"):
            if f"{side}.{name}" in joints:
                yield f"{side}.{name}", joints[f"{side}.{name}"]
        bases = [p for name, p in joints.items() if name.startswith(f"{side}.toe") and name.endswith(".base")]
        if f"{side}.ball" in joints or bases:
            yield f"{side}.ball", joints[f"{side}.ball"] if f"{side}.ball" in joints else np.mean(bases, axis=0)
        for point, toe in (("big_toe_tip", "toe1"), ("middle_toe_tip", "toe3"), ("little_toe_tip", "toe5")):
            if f"{side}.{toe}.tip" in joints:
                yield f"{side}.{point}", joints[f"{side}.{toe}.tip"]
        if f"{side}.toe.tip" in joints:
            yield f"{side}.middle_toe_tip", joints[f"{side}.toe.tip"]


def body_facing(joints: Joints) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Up and forward directions of a body, unit vectors; None where head or hip joints are missing."""
    if not {"head", "left.hip", "right.hip"} <= set(joints):
        return None, None
    up = unit(joints["head"] - joints["pelvis"])
    return up, perpendicular(np.cross(joints["left.hip"] - joints["right.hip"], up), up)


def _face(
    joints: Joints, vertices: NDArray[np.float64], up: NDArray[np.float64], forward: NDArray[np.float64]
) -> Placed:
    """Nose and chin inside the flesh, slightly behind their foremost surface points."""
    for name, point in face_points(joints, vertices, up, forward):
        yield name, point - _SKIN_DEPTH * float((joints["head.top"] - joints["head"]) @ up) * forward


def face_points(
    joints: Joints, vertices: NDArray[np.float64], up: NDArray[np.float64], forward: NDArray[np.float64]
) -> Placed:
    """Nose and chin from the head's midline profile, seen from the skull base."""
    if "head.top" not in joints:
        return
    base = joints["head"]
    height = float((joints["head.top"] - base) @ up)
    away = vertices - base
    high, ahead, aside = away @ up, away @ forward, away @ np.cross(up, forward)
    midline = (np.abs(aside) < 0.15 * height) & (ahead > 0)
    face = np.flatnonzero(midline & (high > -0.2 * height) & (high < height))
    if not len(face):
        return
    nose = face[ahead[face].argmax()]
    yield "nose_tip", vertices[nose]
    # along the height from nose to crown, the lips lie a quarter below the nose, the chin two fifths
    crown = float(high[midline].max() - high[nose])
    lower = np.flatnonzero(midline & (high < high[nose] - 0.36 * crown) & (high > high[nose] - 0.55 * crown))
    if len(lower):
        yield "chin", vertices[lower[ahead[lower].argmax()]]


def _heels(
    joints: Joints, vertices: NDArray[np.float64], faces: NDArray[np.int32], forward: NDArray[np.float64]
) -> Placed:
    for side in ("left", "right"):
        if not {f"{side}.ankle", f"{side}.knee"} <= set(joints):
            continue
        ankle = joints[f"{side}.ankle"]
        shin = ankle - joints[f"{side}.knee"]
        length = float(np.linalg.norm(shin))
        # the heel lies behind and below the ankle
        direction = unit(shin / length - forward)
        near = nearby(vertices, faces, ankle, 0.5 * length)
        heel = find_extremity(vertices, near, ankle, direction, 0.2 * length)
        if heel is not None:
            yield f"{side}.heel", heel
