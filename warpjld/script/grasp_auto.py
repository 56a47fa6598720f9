"""GRASP … AUTO: finds a grasp and sets the keys of the hand and of its joints (A §10, R90)."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from warpjld.errors import InputError
from warpjld.script.binding import cover
from warpjld.script.grasping import Attempt, collisions, placed_at
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from warpjld.covering import Covering
    from warpjld.grasp import GraspObject
    from warpjld.grasp.close import Closer
    from warpjld.grasp.find_grasp import AutoGrasp
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = ["carry", "grasp_by_itself", "key_grip"]

_BEFORE = 0.6
"""Fraction of the arm's motion after which the open hand is in front of the object; the rest is straight."""


def grasp_by_itself(
    scene: Scene,
    actor: Actor,
    prop: Prop,
    side: str,
    first: float,
    last: float,
    tries: int,
    posture_name: str | None,
    digits: Sequence[str] = (),
) -> Attempt:
    """Find a grasp, and set keys: the open hand away from the object at ``first``, on it half-way, closed at ``last``.

    A single hand is moved as a whole; a body's hand is moved by its arm from its pose at ``first``, and the trunk does
    not move. The other objects, at their placements at ``last``, are obstacles. ``digits``, without side, are the only
    ones that close; empty: those of the posture.

    Raises:
        InputError: Nothing was found.
    """
    from warpjld.grasp.close import Closer
    from warpjld.grasp.find_grasp import find_grasp
    from warpjld.grasp.intersection import intersection

    if actor.recorded is not None:
        raise InputError(f"actor {actor.name} is driven by a MOTION file: no angle can be searched")
    covering = cover(actor)
    thing = placed_at(scene, prop, last)
    obstacles = [placed_at(scene, other, last) for other in scene.props.values() if other is not prop]
    closer, middle = Closer(covering, thing, device=scene.device), (first + last) / 2.0
    if f"{side}.shoulder" in actor.skeleton.names:
        found = _by_arm(scene, actor, closer, side, (first, middle, last), obstacles, tries, posture_name, digits)
    else:
        found = find_grasp(
            covering,
            thing,
            closer=closer,
            obstacles=obstacles,
            side=side,
            count=tries,
            posture=posture_name,
            digits=digits,
        )
        carry(scene, actor, found, (first, middle, last))
    key_grip(scene, actor, found, (first, middle, last))
    inside = intersection(covering, covering.deform(stage(actor, np.array([last]), scene.rate))[0], thing)
    message = (
        f"the best of {found.tried} placements, posture {found.posture}: {len(found.touching)} digits touch; {inside}"
    )
    others = [*collisions(scene, actor, prop, first, last), *_through_body(scene, actor, covering, side, first, last)]
    message += "".join(f"; {note}" for note in others)
    values = {
        "posture": found.posture,
        "score": round(found.score, 4),
        "epsilon": round(found.verdict.epsilon, 4),
        "digits": list(found.touching),
        "penetration_mm": round(1e3 * found.penetration, 4),
        "collisions": others,
    }
    return Attempt(f"GRASP {prop.name} AUTO", last, actor.name, prop.name, "CONVERGED", message, values)


def key_grip(scene: Scene, actor: Actor, found: AutoGrasp, frames: tuple[float, float, float]) -> None:
    """Set keys of the joints: open at the first two frames, closed at the last; RELEASE opens them again."""
    from warpjld.grasp.postures import CLOSING
    from warpjld.skeleton import CHANNELS

    first, middle, last = frames
    grip = {}
    rest = actor.skeleton.initial
    changed = np.argwhere((found.start != rest) | (found.angles != rest))
    for joint, column in changed.tolist():
        channel = f"{actor.skeleton.names[joint]}.{CHANNELS[column]}"
        start, closed = float(found.start[joint, column]), float(found.angles[joint, column])
        grip[channel] = start
        actor.set_keys(channel, [first, middle], start, scene.spline)
        actor.set_keys(channel, [last], closed, scene.spline)
    scene.grips[actor.name] = scene.grips.get(actor.name, {}) | grip
    closing = CLOSING.get(found.posture)
    idle = {channel for channel in grip if closing is not None and channel.split(".")[-3] not in closing}
    scene.idle[actor.name] = (scene.idle.get(actor.name, set()) - grip.keys()) | idle


def carry(scene: Scene, actor: Actor, found: AutoGrasp, frames: tuple[float, float, float]) -> None:
    """Set keys of a hand's placement: away from the object at the first frame, at it at the second and third."""
    from scipy.spatial.transform import Rotation

    from warpjld.grasp.random_placements import WAY
    from warpjld.motion import Key

    away = found.position - WAY * found.approach
    turn = Rotation.from_quat(found.rotation).as_euler("xyz")
    spline = asdict(scene.spline)
    for k, axis in enumerate("xyz"):
        for key, value in zip(frames, (away[k], found.position[k], found.position[k]), strict=True):
            actor.placement.set_key(f"move.{axis}", Key(key, float(value), **spline))
            actor.placement.set_key(f"turn.{axis}", Key(key, float(turn[k]), **spline))


def _through_body(scene: Scene, actor: Actor, covering: Covering, side: str, first: float, last: float) -> list[str]:
    """Message about the frames at which the arm of a body passes through the rest of it; empty if there are none."""
    from warpjld.script.arm_way import pierced_frames
    from warpjld.skeleton.arm import arm_of

    if f"{side}.shoulder" not in actor.skeleton.names:
        return []
    pierced = pierced_frames(scene, actor, covering, arm_of(actor.skeleton, side), first, last)
    through = [f"{frame:.4g}" for frame, count in pierced.items() if count]
    return [f"the arm passes through the body at frame {', '.join(through)}"] if through else []


def _by_arm(
    scene: Scene,
    actor: Actor,
    closer: Closer,
    side: str,
    frames: tuple[float, float, float],
    obstacles: Sequence[GraspObject],
    tries: int,
    posture_name: str | None,
    digits: Sequence[str],
) -> AutoGrasp:
    """Find a grasp within the arm's reach, and set the arm's keys: in front of the object, then at it."""
    from warpjld.script.arm_way import key_arm
    from warpjld.script.grasp_by_arm import grasp_in_reach
    from warpjld.script.grasping import posture

    first, middle, last = frames
    found = grasp_in_reach(
        scene,
        actor,
        closer,
        side,
        (middle, last),
        obstacles=obstacles,
        count=tries,
        posture_name=posture_name,
        digits=digits,
    )
    _, angles = posture(scene, actor, first)
    moments = ((first, found.arm.values(angles[0])), (first + _BEFORE * (middle - first), found.before))
    for frame, values in (*moments, (middle, found.there), (last, found.there)):
        key_arm(scene, actor, found.arm, frame, values)
    return found.grasp
