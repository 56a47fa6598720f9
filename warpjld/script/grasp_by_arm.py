"""GRASP … AUTO of a body: finds a grasp that the arm can reach (A §7, R90)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.arm_clearance import ArmClearance
from warpjld.grasp.find_grasp import AutoGrasp, find_grasp
from warpjld.grasp.random_placements import WAY
from warpjld.script.grasping import posture
from warpjld.script.reaching import REACHED, arm_to_hand
from warpjld.skeleton.arm import Arm, arm_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from warpjld.grasp import GraspObject
    from warpjld.grasp.close import Closer
    from warpjld.script.scene import Actor, Scene

__all__ = ["ArmGrasp", "grasp_in_reach"]

_SEARCHES = 8
"""Largest number of grasp searches, with different seeds; the first grasp within reach is taken."""
_STRETCH = 1.1
"""Reach from the shoulder, in lengths of the arm; more than 1 because the shoulder girdle moves as well."""
_SHORT = "its arm is {:.0f} mm short of the nearest grasp that was found"
_OFF = math.radians(2.0)
"""Largest rotation error of the hand against the grasp that was found [rad]."""


@dataclass(frozen=True, eq=False)
class ArmGrasp:
    """A grasp and the arm's angles that reach it.

    Attributes:
        grasp: The grasp of the hand.
        arm: The arm.
        there: Angles of the arm at the grasp [rad], shape (n,).
        before: Angles of the arm with the open hand in front of the object [rad], shape (n,).
    """

    grasp: AutoGrasp
    arm: Arm
    there: NDArray[np.float64]
    before: NDArray[np.float64]


def grasp_in_reach(
    scene: Scene,
    actor: Actor,
    closer: Closer,
    side: str,
    frames: tuple[float, float],
    *,
    obstacles: Sequence[GraspObject],
    count: int,
    posture_name: str | None,
    digits: Sequence[str] = (),
) -> ArmGrasp:
    """Search for grasps until the arm reaches one, inside its limits and without passing through the body.

    Args:
        scene: The scene.
        actor: The body.
        closer: ``Closer`` of its hand and the object.
        side: ``left`` or ``right``.
        frames: Frames at which the open hand is at the object, and at which it has closed.
        obstacles: As for ``find_grasp``; likewise ``count``, ``posture_name`` and ``digits``.

    Raises:
        InputError: No grasp was found, or none is within reach; states how far the arm is short of the nearest.
    """
    arm = arm_of(actor.skeleton, side)
    poses, _ = posture(scene, actor, frames[0])
    clearance = ArmClearance(closer.covering, arm, poses)
    shoulder = poses.positions[0, arm.joints[arm.shoulder]]
    nearest, why = math.inf, ""
    for seed in range(_SEARCHES):
        try:
            grasp = find_grasp(
                closer.covering,
                closer.thing,
                closer=closer,
                obstacles=obstacles,
                side=side,
                count=count,
                posture=posture_name,
                digits=digits,
                seed=seed,
            )
        except InputError as error:
            why = why or error.message
            continue
        hand = grasp.poses(actor.skeleton)
        beyond = float(np.linalg.norm(hand.positions[0, arm.joints[-1]] - shoulder)) - _STRETCH * arm.length
        if beyond > 0.0:
            if beyond < nearest:
                nearest, why = beyond, _SHORT.format(1e3 * beyond)
            if beyond > arm.length:
                break  # the object itself is out of reach
            continue
        found, pierced = arm_to_hand(scene, actor, arm, clearance, frames[0], hand)
        if found.short < nearest:
            nearest = found.short
            why = _SHORT.format(1e3 * found.short)
            if found.short <= REACHED:
                why = f"at the grasps that its arm comes to it is turned {math.degrees(found.off):.0f}° from them"
                why = "its arm passes through the body on every grasp that it comes to" if pierced else why
        if found.short <= REACHED and found.off <= _OFF and not pierced:
            away = replace(hand, positions=hand.positions - WAY * grasp.approach)
            back, _ = arm_to_hand(scene, actor, arm, clearance, frames[0], away)
            return ArmGrasp(grasp, arm, arm.values(found.angles), arm.values(back.angles))
    raise InputError(f"{actor.name} cannot take {closer.thing.name.upper()} where it stands: {why}")
