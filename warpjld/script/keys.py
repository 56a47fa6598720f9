"""Reading joints in commands, and setting keys of joint angles within the joints' limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.scene import Actor, Scene, SplineConstants
from warpjld.skeleton import CHANNELS, PAPER_NUMBERS, Skeleton
from warpjld.suggest import did_you_mean

__all__ = ["DIGIT_WORDS", "SIDES", "joint_numbers", "named_joint", "read_joint", "set_keys"]

SIDES = ("LEFT", "RIGHT")
DIGIT_WORDS = ("THUMB", "INDEX", "MIDDLE", "RING", "PINKY")
_SLACK = 1e-6  # tolerance on limits, which are converted from radians [degrees]


def joint_numbers(skeleton: Skeleton) -> dict[int, int]:
    """Joints by their number in scripts: the paper's (A Fig. 2, R7) for a single hand, else the skeleton's order."""
    sides = [side for side in ("left", "right") if f"{side}.index.base" in skeleton.names]
    if len(sides) != 1 or f"{sides[0]}.shoulder" in skeleton.names:
        return {joint: joint for joint in range(len(skeleton))}
    places = {name: joint for joint, name in enumerate(skeleton.names)}
    return {
        number: places[f"{sides[0]}.{name}"] for number, name in PAPER_NUMBERS.items() if f"{sides[0]}.{name}" in places
    }


def read_joint(scene: Scene, arguments: Arguments, side: str | None = None) -> tuple[Actor, int]:
    """Read a joint, by name or by number: of the current actor, or of the one whose side the name begins with.

    Args:
        scene: The scene.
        arguments: The command's arguments.
        side: A side that was read before, which the name then need not contain.

    Raises:
        InputError: There is no such joint.
    """
    if arguments.has_number():
        actor = scene.actor_with(side) if side else scene.actor()
        numbers = joint_numbers(actor.skeleton)
        number = arguments.integer("the joint's number", minimum=0, maximum=max(numbers))
        if number not in numbers:
            raise arguments.error(f"actor {actor.name} has no joint {number}")
        return actor, numbers[number]
    name = arguments.name("a joint's name or number").lower()
    if side and not name.startswith(f"{side.lower()}."):
        name = f"{side.lower()}.{name}"
    try:
        first = name.partition(".")[0]
        actor = scene.actor_with(first) if first in ("left", "right") else scene.actor()
        return actor, actor.skeleton.index(name)
    except InputError as error:
        raise arguments.error(error.message) from None


def named_joint(actor: Actor, name: str, arguments: Arguments) -> int:
    """Number of an actor's joint.

    Raises:
        InputError: It has no such joint.
    """
    try:
        return actor.skeleton.index(name.lower())
    except InputError as error:
        raise arguments.error(error.message) from None


def set_keys(
    actor: Actor,
    joints: Sequence[str],
    channel: str,
    constants: SplineConstants,
    arguments: Arguments,
) -> None:
    """Read ``<key1> <key2> <step> <degrees>`` and set the value at these keys in one channel of several joints.

    Raises:
        InputError: A joint the actor lacks, invalid keys, or an angle beyond the joint's limits.
    """
    names = [joint.lower() for joint in joints]
    for name in names:
        if name not in actor.skeleton.names:
            hint = did_you_mean(name, actor.skeleton.names)
            raise arguments.error(f"actor {actor.name} has no joint {name}{hint}", arguments.position)
    if actor.recorded is not None:
        raise arguments.error(f"actor {actor.name} is driven by a MOTION file: no keys can be set", arguments.position)
    keys, degrees = arguments.keys_and_value()
    for name in names:
        limits = actor.skeleton.limits[actor.skeleton.names.index(name), CHANNELS.index(channel.lower())]
        low, high = np.degrees(limits)
        if not low - _SLACK <= degrees <= high + _SLACK:
            change = f"LIMIT {name} {channel} <smallest> <largest> changes that"
            if low == high == 0.0:
                raise arguments.error(f"{name} has no {channel.lower()}; {change}")
            raise arguments.error(
                f"{channel.lower()} of {name} goes from {low:.4g}° to {high:.4g}°, got {degrees:g}°; {change}"
            )
    for name in names:
        actor.set_keys(f"{name}.{channel.lower()}", keys, math.radians(degrees), constants)
