"""GRASP … BOTH … AUTO: finds a grasp with two hands and sets their keys (A §10, R90)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.errors import InputError
from warpjld.script.binding import cover
from warpjld.script.grasp_auto import carry, key_grip
from warpjld.script.grasping import Attempt, collisions, placed_at

if TYPE_CHECKING:
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = ["both_hands", "grasp_by_both"]


def both_hands(scene: Scene) -> dict[str, Actor]:
    """The actors that are a left and a right hand.

    Raises:
        InputError: One is missing, both belong to one actor, one has an arm, or is driven by a MOTION file.
    """
    hands = {side: scene.actor_with(side) for side in ("left", "right")}
    for side, actor in hands.items():
        alone = side == "left" or actor is not hands["left"]
        if not alone or f"{side}.shoulder" in actor.skeleton.names:
            raise InputError(
                "GRASP … BOTH … AUTO moves hands as a whole: want an actor that is a left hand alone and one that is a "
                f"right hand alone; {actor.name} is more than that"
            )
        if actor.recorded is not None:
            raise InputError(f"actor {actor.name} is driven by a MOTION file: no angle can be searched")
    return hands


def grasp_by_both(scene: Scene, prop: Prop, first: float, last: float, tries: int) -> list[Attempt]:
    """Find a grasp with two hands, and set the keys of both.

    Open and away from the object at ``first``, on it half-way, closed at ``last``. The other objects, at their
    placements at ``last``, are obstacles.

    Raises:
        InputError: Nothing was found.
    """
    from warpjld.grasp.two_hands import find_two_handed

    actors, middle = both_hands(scene), (first + last) / 2.0
    obstacles = [placed_at(scene, other, last) for other in scene.props.values() if other is not prop]
    coverings = {side: cover(actor) for side, actor in actors.items()}
    found = find_two_handed(
        coverings, placed_at(scene, prop, last), obstacles=obstacles, count=tries, device=scene.device
    )
    attempts = []
    for side, actor in actors.items():
        own = found[side]
        carry(scene, actor, own, (first, middle, last))
        key_grip(scene, actor, own, (first, middle, last))
        others = collisions(scene, actor, prop, first, last)
        message = f"the best of {own.tried} placements of two hands: {len(own.touching)} digits touch"
        message += ", both palms press" if own.verdict.palm else ", no two palms do"
        message += "".join(f"; {told}" for told in others)
        values = {
            "posture": own.posture,
            "score": round(own.score, 4),
            "epsilon": round(own.verdict.epsilon, 4),
            "digits": list(own.touching),
            "penetration_mm": round(1e3 * own.penetration, 4),
            "collisions": others,
        }
        command = f"GRASP BOTH {prop.name} AUTO"
        attempts.append(Attempt(command, last, actor.name, prop.name, "CONVERGED", message, values))
    return attempts
