"""GRASP … AUTO of a body: of the grasps that a hand finds one to which its arm comes (A §7, R90)."""

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
"""Grasps, each found from other placements, of which the first is taken that the arm comes to."""
_STRETCH = 1.1
"""Lengths of the arm to which a hand comes at most from where its shoulder is: the girdle goes along a little."""
_SHORT = "its arm is {:.0f} mm short of the nearest grasp that was found"
_OFF = math.radians(2.0)
"""How far the hand may be turned from the grasp that was found."""


@dataclass(frozen=True, eq=False)
class ArmGrasp:
    """A grasp and the arm that brings the hand there.

    Attributes:
        grasp: As found for the hand.
        arm: The arm.
        there: Its angles at the grasp [rad], shape (n,).
        before: Its angles with the open hand before the object, shape (n,).
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
) -> ArmGrasp:
    """Find grasps until the arm comes to one, inside its limits and without passing through the body.

    Args:
        scene, actor: The body on its stage.
        closer: Its hand and the object.
        side: Which hand.
        frames: When the open hand is at the object, and when it has closed.
        obstacles, count, posture_name: As of ``find_grasp``.

    Raises:
        InputError: No grasp was found, or the arm comes to none; says how far it is short of the nearest.
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
                break  # nor does it come to any other
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
