"""Bringing rigs on stage, and what belongs to their skeletons: axes, limits, recorded motion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from warpjld.script.arguments import Arguments
from warpjld.script.commands.animation import SIDES
from warpjld.script.keys import read_joint
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.skeleton import CHANNELS

if TYPE_CHECKING:
    from warpjld.rig import Rig


@command(
    "HAND",
    syntax=(
        "HAND <LEFT/RIGHT> BUILTIN [LENGTH <metres>] [BREADTH <metres>] [RESOLUTION <vertices>] [NAME <actor>]"
        ' or HAND <LEFT/RIGHT> "<rig file>" [NAME <actor>]'
    ),
    help="Bring on a hand: the built-in one, or a rig from a file. The actor is called LEFT or RIGHT unless named.",
    group="Actors",
)
def hand(scene: Scene, arguments: Arguments) -> None:
    """R7."""
    side: Literal["left", "right"] = "left" if arguments.choice("the side", SIDES) == "LEFT" else "right"
    if arguments.keyword("BUILTIN"):
        from warpjld.hand import build_hand

        options = arguments.options(
            length=lambda: arguments.number("the hand's length in metres"),
            breadth=lambda: arguments.number("the hand's breadth in metres"),
            resolution=lambda: arguments.integer("the number of vertices, about"),
            name=lambda: arguments.name("the actor's name"),
        )
        name = options.pop("name", side)
        rig = build_hand(side, **options)  # type: ignore[arg-type]
    else:
        if not arguments.has_text():
            raise arguments.expected("BUILTIN or a rig file in quotes")
        path = arguments.input_file("a rig file")
        name = _name(arguments, side)
        rig = _load(path, side=side)
    scene.add(str(name), rig)


@command(
    "BODY",
    syntax='BODY "<rig file>" [NAME <actor>]',
    help="Bring on a rig with any skeleton: a body, an animal. The actor is called BODY unless named.",
    group="Actors",
)
def body(scene: Scene, arguments: Arguments) -> None:
    """R12, R30."""
    path = arguments.input_file("a rig file")
    name = _name(arguments, "body")
    scene.add(name, _load(path))


@command(
    "MODEL",
    syntax='MODEL "<surface file>" SKELETON "<skeleton file>" [NAME <actor>]',
    help="Bring on a bare surface with a skeleton file. The actor is called MODEL unless named.",
    group="Actors",
)
def model(scene: Scene, arguments: Arguments) -> None:
    """R17: a surface of any origin."""
    path = arguments.input_file("a surface file")
    arguments.choice("", ("SKELETON",))
    skeleton = arguments.input_file("a skeleton file")
    name = _name(arguments, "model")
    scene.add(name, _load(path, skeleton=skeleton))


@command(
    "ACTOR",
    syntax="ACTOR <name>",
    help="Commands that follow speak to this actor where more than one could be meant.",
    group="Actors",
)
def actor(scene: Scene, arguments: Arguments) -> None:
    """R89."""
    scene.current = scene.actor(arguments.name("an actor's name")).name


@command(
    "MOTION",
    syntax='MOTION "<motion file>"',
    help="Drive the current actor by a motion file instead of keys, at the RATE set before.",
    group="Actors",
)
def motion(scene: Scene, arguments: Arguments) -> None:
    """R110 and any recorded motion."""
    from warpjld.motion import load_motion

    chosen = scene.actor()
    path = arguments.input_file("a motion file")
    if chosen.keyed:
        raise arguments.error(f"actor {chosen.name} has keys already: it cannot be driven by a file as well")
    rig = replace(chosen.rig, skeleton=chosen.skeleton)  # with the script's axes and limits
    chosen.recorded = load_motion(path, rig, rate=scene.rate)


@command(
    "AXIS",
    syntax="AXIS <joint> <x> <y> <z>",
    help="Flexion axis of a joint at rest.",
    group="Actors",
)
def axis(scene: Scene, arguments: Arguments) -> None:
    """R21."""
    chosen, joint = read_joint(scene, arguments)
    vector = np.array(arguments.vector("the axis"))
    if np.linalg.norm(vector) < 1e-9:
        raise arguments.error("an axis cannot be 0 0 0")
    axes = chosen.skeleton.axes.copy()
    axes[joint] = vector
    chosen.skeleton = chosen.skeleton.with_axes(axes)


@command(
    "LIMIT",
    syntax="LIMIT <joint> <FLEXION/PIVOT/TWISTING/ABDUCTION> <smallest> <largest>",
    help="How far a joint may go, in degrees; the largest flexion also scales inflation.",
    group="Actors",
)
def limit(scene: Scene, arguments: Arguments) -> None:
    """R24, R59."""
    chosen, joint = read_joint(scene, arguments)
    channel = arguments.choice("the angle", [c.upper() for c in CHANNELS])
    low = arguments.number("the smallest angle", minimum=-360, maximum=360)
    high = arguments.number("the largest angle", minimum=-360, maximum=360)
    if high < low:
        raise arguments.error(f"the largest angle must not be below the smallest ({low:g}), got {high:g}")
    limits = chosen.skeleton.limits.copy()
    limits[joint, CHANNELS.index(channel.lower())] = math.radians(low), math.radians(high)
    chosen.skeleton = replace(chosen.skeleton, limits=limits)


def _name(arguments: Arguments, default: str) -> str:
    return str(arguments.options(name=lambda: arguments.name("the actor's name")).get("name", default))


def _load(path: object, **options: object) -> Rig:
    from warpjld.io import load_rig

    return load_rig(path, **options)  # type: ignore[arg-type]
