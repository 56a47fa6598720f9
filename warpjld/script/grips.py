"""Argument readers shared by the commands about grasps and grips: two frames, a side, a gripping actor."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from warpjld.script.arguments import Arguments
from warpjld.script.keys import SIDES
from warpjld.script.scene import Scene
from warpjld.skeleton import CHANNELS
from warpjld.skeleton.channels import FLEXION

if TYPE_CHECKING:
    from warpjld.script.scene import Actor

__all__ = ["flexions_of_grip", "gripping_actor", "read_actor", "read_frames", "read_side"]


def read_frames(arguments: Arguments, begin: str, end: str) -> tuple[float, float]:
    """Read ``<key1> <key2>``; the texts complete "the frame …" in error messages.

    Raises:
        InputError: key2 does not come after key1.
    """
    first = arguments.number(f"key1 (the frame {begin})")
    last = arguments.number(f"key2 (the frame {end})")
    if last <= first:
        raise arguments.error(f"key2 must come after key1 ({first:g}), got {last:g}")
    return first, last


def read_side(scene: Scene, arguments: Arguments) -> str:
    """Read ``[LEFT/RIGHT]``, in lower case; if it is left out, the only side of the current actor."""
    side = arguments.keyword(*SIDES)
    if side is not None:
        return side.lower()
    names = scene.actor().skeleton.names
    sides = [s for s in ("left", "right") if any(n.startswith(f"{s}.") for n in names)]
    if len(sides) != 1:
        raise arguments.expected("LEFT/RIGHT")
    return sides[0]


def read_actor(scene: Scene, arguments: Arguments) -> Actor:
    """Read ``[LEFT/RIGHT]``: the actor with that hand; the current actor if it is left out."""
    side = arguments.keyword(*SIDES)
    return scene.actor_with(side) if side else scene.actor()


def gripping_actor(scene: Scene, arguments: Arguments) -> Actor:
    """Read ``[LEFT/RIGHT]``: an actor whose digits were closed by GRASP.

    Raises:
        InputError: They were not.
    """
    actor = read_actor(scene, arguments)
    if actor.name not in scene.grips:
        raise arguments.error(
            f"actor {actor.name} has grasped nothing: there is no grip to tighten", arguments.position
        )
    return actor


def flexions_of_grip(scene: Scene, actor: Actor, frame: float) -> Iterator[tuple[str, float, tuple[float, float]]]:
    """Flexions that tighten a grip: channel, value at a frame, and limits [rad].

    Second and third joints that GRASP did not flex are left out: the digit touches nearer to its base; likewise
    fingers that take no part in it.
    """
    idle = scene.idle.get(actor.name, set())
    for channel in (channel for channel in scene.grips[actor.name] if channel not in idle):
        joint, _, kind = channel.rpartition(".")
        if kind != CHANNELS[FLEXION]:
            continue
        now = actor.value(channel, frame)
        number = actor.skeleton.index(joint)
        low, high = actor.skeleton.limits[number, FLEXION]
        if now > actor.skeleton.initial[number, FLEXION] + 1e-9 or not joint.endswith(("knuckle2", "knuckle3")):
            yield channel, now, (float(low), float(high))
