"""GRASP … AUTO: a grasp is found, and becomes the keys of the hand and of its joints (A §10, R90)."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from warpjld.errors import InputError
from warpjld.script.binding import cover
from warpjld.script.grasping import Attempt, collisions, placed_at
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = ["grasp_by_itself"]


def grasp_by_itself(
    scene: Scene, actor: Actor, prop: Prop, side: str, first: float, last: float, tries: int, posture_name: str | None
) -> Attempt:
    """Find a grasp, and set keys: the open hand away from the object at ``first``, on it half-way, closed at ``last``.

    The other objects are obstacles where they are at ``last``.

    Raises:
        InputError: Nothing was found.
    """
    from scipy.spatial.transform import Rotation

    from warpjld.grasp.auto import find_grasp
    from warpjld.grasp.close import Closer
    from warpjld.grasp.draws import WAY
    from warpjld.grasp.intersection import intersection
    from warpjld.motion import Key
    from warpjld.skeleton import CHANNELS

    if actor.recorded is not None:
        raise InputError(f"actor {actor.name} is driven by a MOTION file: no angle can be searched")
    covering = cover(actor)
    thing = placed_at(scene, prop, last)
    obstacles = [placed_at(scene, other, last) for other in scene.props.values() if other is not prop]
    found = find_grasp(Closer(covering, thing), obstacles=obstacles, side=side, count=tries, posture=posture_name)
    middle, away = (first + last) / 2.0, found.position - WAY * found.approach
    turn = Rotation.from_quat(found.rotation).as_euler("xyz")
    spline = asdict(scene.spline)
    for k, axis in enumerate("xyz"):
        for key, value in ((first, away[k]), (middle, found.position[k]), (last, found.position[k])):
            actor.placement.set_key(f"move.{axis}", Key(key, float(value), **spline))
        for key in (first, middle, last):
            actor.placement.set_key(f"turn.{axis}", Key(key, float(turn[k]), **spline))
    grip = {}
    changed = np.argwhere((found.start != 0.0) | (found.angles != 0.0))
    for joint, column in changed.tolist():
        channel = f"{actor.skeleton.names[joint]}.{CHANNELS[column]}"
        start, closed = float(found.start[joint, column]), float(found.angles[joint, column])
        grip[channel] = start
        actor.set_keys(channel, [first, middle], start, scene.spline)
        actor.set_keys(channel, [last], closed, scene.spline)
    scene.grips[actor.name] = scene.grips.get(actor.name, {}) | grip
    inside = intersection(covering, covering.deform(stage(actor, np.array([last]), scene.rate))[0], thing)
    message = (
        f"the best of {found.tried} placements, posture {found.posture}: {len(found.touching)} digits touch; {inside}"
    )
    others = collisions(scene, actor, prop, first, last)
    message += "".join(f"; {told}" for told in others)
    values = {
        "posture": found.posture,
        "score": round(found.score, 4),
        "epsilon": round(found.verdict.epsilon, 4),
        "digits": list(found.touching),
        "penetration_mm": round(1e3 * found.penetration, 4),
        "collisions": others,
    }
    return Attempt(f"GRASP {prop.name} AUTO", last, actor.name, prop.name, "CONVERGED", message, values)
