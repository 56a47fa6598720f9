"""Commands that set keys of joint angles (A §9, R79–R84), and of the placement of actors and objects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict

from warpjld.motion import Key
from warpjld.script.arguments import Arguments
from warpjld.script.keys import DIGIT_WORDS, SIDES, read_joint, set_keys
from warpjld.script.registry import command
from warpjld.script.scene import Scene, SplineConstants
from warpjld.skeleton import CHANNELS

_KEYS = "<key1> <key2> <step> <degrees>"


def _limb(scene: Scene, arguments: Arguments, joint: str, channels: Sequence[str]) -> None:
    """Read side, channel and keys of a joint of an arm, and set the keys."""
    side, channel = arguments.choices(SIDES, channels)
    set_keys(scene.actor_with(side), [f"{side}.{joint}"], channel, scene.spline, arguments)


@command(
    "SHOULDER",
    syntax=f"SHOULDER <LEFT/RIGHT> <FLEXION/PIVOT/TWISTING/ABDUCTION> {_KEYS}",
    help="Shoulder angle at key1, key1 + step, … up to key2.",
    group="Animation",
)
def shoulder(scene: Scene, arguments: Arguments) -> None:
    """Shoulder angle at key1, key1 + step, … up to key2 (R79)."""
    _limb(scene, arguments, "shoulder", ("FLEXION", "PIVOT", "TWISTING", "ABDUCTION"))


@command(
    "ELBOW",
    syntax=f"ELBOW <LEFT/RIGHT> <FLEXION/TWISTING> {_KEYS}",
    help="Elbow angle.",
    group="Animation",
)
def elbow(scene: Scene, arguments: Arguments) -> None:
    """Elbow angle (R80)."""
    _limb(scene, arguments, "elbow", ("FLEXION", "TWISTING"))


@command(
    "WRIST",
    syntax=f"WRIST <LEFT/RIGHT> <FLEXION/PIVOT/ABDUCTION> {_KEYS}",
    help="Wrist angle.",
    group="Animation",
)
def wrist(scene: Scene, arguments: Arguments) -> None:
    """Wrist angle (R81)."""
    _limb(scene, arguments, "wrist", ("FLEXION", "PIVOT", "ABDUCTION"))


@command(
    "METACARPUS",
    syntax=f"METACARPUS <LEFT/RIGHT> {_KEYS}",
    help="Flexion of the ring's and the pinky's metacarpals, 0 to 20 degrees: hollows the palm.",
    group="Animation",
)
def metacarpus(scene: Scene, arguments: Arguments) -> None:
    """Flexion of the ring's and the pinky's metacarpals, 0 to 20 degrees: hollows the palm (R82)."""
    (side,) = arguments.choices(SIDES)
    joints = [f"{side}.ring.carpometacarpal", f"{side}.pinky.carpometacarpal"]
    set_keys(scene.actor_with(side), joints, "FLEXION", scene.spline, arguments)


@command(
    "FINGER1",
    syntax=f"FINGER1 <LEFT/RIGHT> <THUMB/INDEX/MIDDLE/RING/PINKY> <FLEXION/PIVOT/ABDUCTION> {_KEYS}",
    help="Angle at the base of a finger. PIVOT turns the axis of flexion; ABDUCTION spreads the finger.",
    group="Animation",
)
def finger1(scene: Scene, arguments: Arguments) -> None:
    """Angle at the base of a finger. PIVOT turns the axis of flexion; ABDUCTION spreads the finger (R83)."""
    side, finger, channel = arguments.choices(SIDES, DIGIT_WORDS, ("FLEXION", "PIVOT", "ABDUCTION"))
    set_keys(scene.actor_with(side), [f"{side}.{finger}.base"], channel, scene.spline, arguments)


@command(
    "FINGER23",
    syntax=f"FINGER23 <LEFT/RIGHT> <THUMB/INDEX/MIDDLE/RING/PINKY> <KNUCKLES2/KNUCKLES3> {_KEYS}",
    help="Flexion of a finger's second or third joint.",
    group="Animation",
)
def finger23(scene: Scene, arguments: Arguments) -> None:
    """Flexion of a finger's second or third joint (R84)."""
    side, finger, knuckle = arguments.choices(SIDES, DIGIT_WORDS, ("KNUCKLES2", "KNUCKLES3"))
    joint = f"{side}.{finger}.{knuckle.replace('KNUCKLES', 'knuckle')}"
    set_keys(scene.actor_with(side), [joint], "FLEXION", scene.spline, arguments)


@command(
    "JOINT",
    syntax=f"JOINT <joint> <FLEXION/PIVOT/TWISTING/ABDUCTION> {_KEYS}",
    help="Angle of any joint, by name (left.index.base) or, for the current actor, by number.",
    group="Animation",
)
def joint_(scene: Scene, arguments: Arguments) -> None:
    """Angle of any joint, by name (left.index.base) or, for the current actor, by number (R10–R12)."""
    actor, joint = read_joint(scene, arguments)
    channel = arguments.choice("the angle", [c.upper() for c in CHANNELS])
    set_keys(actor, [actor.skeleton.names[joint]], channel, scene.spline, arguments)


@command(
    "MOVE",
    syntax="MOVE <actor or object> <key> <x> <y> <z>",
    help="Displacement of an actor or an object from its initial position at a key, in metres.",
    group="Animation",
)
def move(scene: Scene, arguments: Arguments) -> None:
    """Displacement of an actor or an object from its initial position at a key, in metres (R89)."""
    placement = scene.placement(arguments.name("an actor's or an object's name"))
    key = arguments.number("the key (a frame)")
    for axis, value in zip("xyz", arguments.vector("the displacement's"), strict=True):
        placement.set_key(f"move.{axis}", Key(key, value, **asdict(scene.spline)))


@command(
    "TURN",
    syntax="TURN <actor or object> <key> <x> <y> <z>",
    help="Rotation of an actor about its root, an object about its origin, at a key: degrees about x, then y, then z.",
    group="Animation",
)
def turn(scene: Scene, arguments: Arguments) -> None:
    """Rotation of an actor about its root, an object about its origin, at a key (R89)."""
    placement = scene.placement(arguments.name("an actor's or an object's name"))
    key = arguments.number("the key (a frame)")
    for axis, value in zip("xyz", arguments.vector("the rotation about"), strict=True):
        placement.set_key(f"turn.{axis}", Key(key, math.radians(value), **asdict(scene.spline)))


@command(
    "SPLINE",
    syntax="SPLINE <tension> [<continuity> <bias>]",
    help="Kochanek–Bartels constants, −1 to 1, of the keys set after this line; 0 0 0 by default.",
    group="Animation",
)
def spline(scene: Scene, arguments: Arguments) -> None:
    """Kochanek–Bartels constants, −1 to 1, of the keys set after this line; 0 0 0 by default (R3)."""
    tension = arguments.number("the tension", minimum=-1, maximum=1)
    if not arguments:
        scene.spline = SplineConstants(tension)
        return
    continuity = arguments.number("the continuity", minimum=-1, maximum=1)
    scene.spline = SplineConstants(tension, continuity, arguments.number("the bias", minimum=-1, maximum=1))


@command(
    "FRAMES",
    syntax="FRAMES <first> <last>",
    help="Frames to compute, both included; without this command, from the first key to the last.",
    group="Animation",
)
def frames(scene: Scene, arguments: Arguments) -> None:
    """Frames to compute, both included; without this command, from the first key to the last (R4)."""
    first = arguments.integer("the first frame")
    last = arguments.integer("the last frame")
    if last < first:
        raise arguments.error(f"the last frame must not come before the first ({first}), got {last}")
    scene.first, scene.last = first, last


@command("RATE", syntax="RATE <frames a second>", help="Frames per second; 30 by default.", group="Animation")
def rate(scene: Scene, arguments: Arguments) -> None:
    """Frames per second; 30 by default (R2)."""
    scene.rate = arguments.number("the rate in frames a second", above=0, maximum=1000)
