"""Commands that tighten a grip: by an angle, to a force (SQUEEZE), or until it holds a weight (LIFT) (R123, R124)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, cast

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import place, read_object
from warpjld.script.contact import REST
from warpjld.script.grips import flexions_of_grip, gripping_actor, read_actor, read_frames
from warpjld.script.keys import DIGIT_WORDS
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.specification import GripSpecification

if TYPE_CHECKING:
    from warpjld.script.scene import Actor

_MOST = 20.0
"""Default of the largest angle by which digits close further [degrees]; assumed."""


@command(
    "SQUEEZE",
    syntax=(
        "SQUEEZE <key1> <key2> [LEFT/RIGHT] <degrees>, or SQUEEZE <key1> <key2> [LEFT/RIGHT] FORCE <newtons> "
        "[THUMB/INDEX/MIDDLE/RING/PINKY …] [SHARED BY MUSCLES] [MOST <degrees>]"
    ),
    help="Flex closed digits further: by an angle, or until they press with a FORCE, each alike or as its MUSCLES can.",
    group="Contact",
)
def squeeze(scene: Scene, arguments: Arguments) -> None:
    """Flex closed digits further into the object, by up to an angle or until they press with a force (R112, R118)."""
    first, last = read_frames(arguments, "from which on the digits press", "at which they press most")
    actor = gripping_actor(scene, arguments)
    if not arguments.keyword("FORCE"):
        degrees = arguments.number("the angle in degrees, or FORCE", minimum=-90, maximum=90)
        for channel, now, (low, high) in flexions_of_grip(scene, actor, first):
            actor.set_keys(channel, [first], now, scene.spline)
            actor.set_keys(channel, [last], min(max(now + math.radians(degrees), low), high), scene.spline)
        return
    force = arguments.number("the force in newtons", above=0.0)
    digits = []
    while digit := arguments.keyword(*DIGIT_WORDS):
        digits.append(digit.lower())
    share: Literal["muscles"] | None = None
    if arguments.keyword("SHARED"):
        arguments.choice("", ("BY",))
        arguments.choice("", ("MUSCLES",))
        share = "muscles"
    most = _most(arguments, *(() if share else ("SHARED",)))
    channels = _held_keys(scene, actor, arguments, first, last)
    closing = {channel.split(".")[-3] for channel in channels}
    for digit in digits:
        if digit not in closing:
            raise arguments.error(f"{digit} does not close here; {', '.join(sorted(closing))} do", arguments.position)
    here = place(arguments)
    wish = GripSpecification(
        actor.name, "", first, last, channels, most, force=force, digits=tuple(digits), share=share, where=here
    )
    scene.contact.grips.append(wish)


@command(
    "LIFT",
    syntax="LIFT <key1> <key2> [LEFT/RIGHT] <object> [WEIGHT <newtons>] [MOST <degrees>]",
    help="Find the gentlest grip that holds an object's weight: it is reached half-way to key2; then the support goes.",
    group="Contact",
)
def lift(scene: Scene, arguments: Arguments) -> None:
    """Find the gentlest grip that holds an object's weight; it is reached half-way to key2 (R123, R124)."""
    first, last = read_frames(arguments, "from which on the digits close", "at which they hold the object")
    if last - first < 4.0:
        raise arguments.error(f"LIFT needs 4 frames or more, got {last - first:g}")
    actor = gripping_actor(scene, arguments)
    prop = read_object(scene, arguments)
    if prop.name not in scene.contact.physical:
        raise arguments.error(f"{prop.name} is not physical and weighs nothing: make it so with PHYSICAL {prop.name}")
    if scene.contact.lifted(prop.name) is not None:
        raise arguments.error(f"{prop.name} is lifted already")
    options = arguments.options(
        weight=lambda: arguments.number("the weight in newtons", above=0.0),
        most=lambda: arguments.number("the angle in degrees", above=0.0, maximum=90.0),
    )
    most = math.radians(float(cast(float, options.get("most", _MOST))))
    channels = _held_keys(scene, actor, arguments, first, round(0.5 * (first + last)), last)
    weight = cast("float | None", options.get("weight"))
    wish = GripSpecification(
        actor.name, prop.name, first, last, channels, most, lift=True, weight=weight, where=place(arguments)
    )
    scene.contact.grips.append(wish)


@command(
    "STRENGTH",
    syntax="STRENGTH [LEFT/RIGHT] <THUMB/INDEX/MIDDLE/RING/PINKY> <newtons>",
    help="Largest force of a digit [N]; by default thumb 69, index and ring 59, middle 82, pinky 33.",
    group="Contact",
)
def strength(scene: Scene, arguments: Arguments) -> None:
    """Largest force of a digit [N]; by default thumb 69, index and ring 59, middle 82, pinky 33 (R118)."""
    actor = read_actor(scene, arguments)
    digit = arguments.choice("the digit", DIGIT_WORDS).lower()
    newtons = arguments.number("the force in newtons", above=0.0)
    scene.contact.strength.setdefault(actor.name, {})[digit] = newtons


def _most(arguments: Arguments, *beside: str) -> float:
    """Read the option MOST: the largest angle by which digits close further [rad]."""
    options = arguments.options(*beside, most=lambda: arguments.number("the angle in degrees", above=0.0, maximum=90.0))
    return math.radians(float(cast(float, options.get("most", _MOST))))


def _held_keys(scene: Scene, actor: Actor, arguments: Arguments, first: float, *later: float) -> tuple[str, ...]:
    """Set keys that hold the grip until the search's result replaces them; names of the channels."""
    if actor.recorded is not None:
        raise arguments.error(f"actor {actor.name} is driven by a MOTION file: no grip can be searched for")
    channels = []
    for channel, now, _ in flexions_of_grip(scene, actor, first):
        actor.set_keys(channel, [first, *later], now, REST)
        channels.append(channel)
    if not channels:
        raise InputError(f"actor {actor.name}: no joint of its grip can close on")
    return tuple(channels)
