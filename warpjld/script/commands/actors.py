"""Commands that add actors (rigs) to the scene, and set their axes, limits, initial angles and recorded motion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from warpjld.errors import InputError
from warpjld.io.placement import METRES
from warpjld.script.arguments import Arguments
from warpjld.script.keys import SIDES, read_joint
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.skeleton import CHANNELS
from warpjld.skeleton.initial import bent_as_before, check_initial
from warpjld.skeleton.tree import ALONG

if TYPE_CHECKING:
    from warpjld.rig import Rig


@command(
    "HAND",
    syntax=(
        "HAND <LEFT/RIGHT> BUILTIN [LENGTH <metres>] [BREADTH <metres>] [RESOLUTION <vertices>] [NAME <actor>]"
        ' or HAND <LEFT/RIGHT> "<rig file>" [UNIT <M/CM/MM or metres>] [SCALE <factor>] [MAP "<joint map>"]'
        " [NAME <actor>]"
    ),
    help="Add a hand to the scene: the built-in one, or a rig from a file. It is called LEFT or RIGHT unless named.",
    group="Actors",
)
def hand(scene: Scene, arguments: Arguments) -> None:
    """Add a hand to the scene: the built-in one, or a rig from a file (R7)."""
    side: Literal["left", "right"] = "left" if arguments.choice("the side", SIDES) == "LEFT" else "right"
    if arguments.keyword("BUILTIN"):
        from warpjld.hand.kept import kept_hand

        options = arguments.options(
            length=lambda: arguments.number("the hand's length in metres"),
            breadth=lambda: arguments.number("the hand's breadth in metres"),
            resolution=lambda: arguments.integer("the number of vertices, about"),
            name=lambda: arguments.new_name("the actor's name"),
        )
        name = options.pop("name", side)
        rig = kept_hand(side, **options)
    else:
        if not arguments.has_text():
            raise arguments.expected("BUILTIN or a rig file in quotes")
        path = arguments.input_file("a rig file")
        options = _options(arguments)
        name = options.pop("name", side)
        rig = _load(path, side=side, **options)
    scene.add(str(name), rig)


@command(
    "BODY",
    syntax=(
        'BODY BUILTIN [HEIGHT <metres>] [NAME <actor>] or BODY "<rig file>" [UNIT <M/CM/MM or metres>]'
        ' [SCALE <factor>] [MAP "<joint map>"] [NAME <actor>]'
    ),
    help="Add a rig with any skeleton: the built-in body, or a file's. The actor is called BODY unless named.",
    group="Actors",
)
def body(scene: Scene, arguments: Arguments) -> None:
    """Add a rig with any skeleton to the scene (R12, R30)."""
    if arguments.keyword("BUILTIN"):
        from warpjld.hand.figure import build_body

        options = arguments.options(
            height=lambda: arguments.number("the body's height in metres"),
            name=lambda: arguments.new_name("the actor's name"),
        )
        name = str(options.pop("name", "body"))
        scene.add(name, build_body(**options))  # type: ignore[arg-type]
        return
    path = arguments.input_file("a rig file")
    options = _options(arguments)
    name = str(options.pop("name", "body"))
    scene.add(name, _load(path, **options))


@command(
    "MODEL",
    syntax=(
        'MODEL "<surface file>" <SKELETON/POINTS> "<skeleton or points file>" [UNIT <M/CM/MM or metres>]'
        ' [SCALE <factor>] [MAP "<joint map>"] [NAME <actor>]'
    ),
    help="Add a surface without joints, with a skeleton file or a points file. It is called MODEL unless named.",
    group="Actors",
)
def model(scene: Scene, arguments: Arguments) -> None:
    """Add a surface without joints, with a skeleton file or a points file (R12, R17)."""
    path = arguments.input_file("a surface file")
    kind = arguments.choice("SKELETON or POINTS", ("SKELETON", "POINTS")).lower()
    joints = arguments.input_file(f"a {kind} file")
    options = _options(arguments)
    name = str(options.pop("name", "model"))
    scene.add(name, _load(path, **{kind: joints}, **options))


@command(
    "ACTOR",
    syntax="ACTOR <name>",
    help="Make this actor the current one: later commands that name no actor apply to it.",
    group="Actors",
)
def actor(scene: Scene, arguments: Arguments) -> None:
    """Make an actor the current one: later commands that name no actor apply to it (R89)."""
    scene.current = scene.actor(arguments.name("an actor's name")).name


@command(
    "MOTION",
    syntax='MOTION "<motion file>" [SIDE <LEFT/RIGHT>] [ANIMATION "<name>"] [FLAT_HAND_MEAN <ON/OFF>]',
    help="Drive the current actor by a motion file instead of keys, sampled at the RATE set before.",
    group="Actors",
)
def motion(scene: Scene, arguments: Arguments) -> None:
    """Drive the current actor by a motion file instead of keys, at the RATE set before (R110)."""
    from warpjld.motion import load_motion

    chosen = scene.actor()
    path = arguments.input_file("a motion file")
    if chosen.keyed:
        raise arguments.error(f"actor {chosen.name} has keys already: it cannot be driven by a file as well")
    options = arguments.options(
        side=lambda: arguments.choice("the side", SIDES).lower(),
        animation=lambda: arguments.text("an animation"),
        flat_hand_mean=lambda: arguments.choice("whether no rotation is the flat hand", ("ON", "OFF")) == "ON",
    )
    rig = replace(chosen.rig, skeleton=chosen.skeleton)  # with the script's axes and limits
    moved = load_motion(path, rig, rate=scene.rate, **options)  # type: ignore[arg-type]
    chosen.recorded, chosen.motion_notes = (moved.poses, moved.rate), moved.notes
    scene.warned(f"{chosen.name}: {warning}" for warning in moved.warnings)


@command(
    "AXIS",
    syntax="AXIS <joint> <x> <y> <z>",
    help="Flexion axis of a joint at rest.",
    group="Actors",
)
def axis(scene: Scene, arguments: Arguments) -> None:
    """Flexion axis of a joint at rest (R21)."""
    chosen, joint = read_joint(scene, arguments)
    vector = np.array(arguments.vector("the axis"))
    if np.linalg.norm(vector) < 1e-9:
        raise arguments.error("an axis cannot be 0 0 0")
    direction = chosen.skeleton.directions[joint]
    if np.linalg.norm(np.cross(direction, vector)) < ALONG * np.linalg.norm(vector):
        x, y, z = direction
        raise arguments.error(
            f"{chosen.skeleton.names[joint]} cannot bend about its own segment, which lies along "
            f"{x:.2f} {y:.2f} {z:.2f}: want an axis across it"
        )
    axes = chosen.skeleton.axes.copy()
    axes[joint] = vector
    chosen.skeleton = bent_as_before(chosen.skeleton, chosen.skeleton.with_axes(axes))


@command(
    "LIMIT",
    syntax="LIMIT <joint> <FLEXION/PIVOT/TWISTING/ABDUCTION> <smallest> <largest>",
    help="Limits of a joint's angle in degrees; the largest flexion also scales inflation.",
    group="Actors",
)
def limit(scene: Scene, arguments: Arguments) -> None:
    """Limits of a joint's angle in degrees; the largest flexion also scales inflation (R24, R59)."""
    chosen, joint = read_joint(scene, arguments)
    channel = arguments.choice("the angle", [c.upper() for c in CHANNELS])
    low = arguments.number("the smallest angle", minimum=-360, maximum=360)
    high = arguments.number("the largest angle", minimum=-360, maximum=360)
    if high < low:
        raise arguments.error(f"the largest angle must not be below the smallest ({low:g}), got {high:g}")
    limits = chosen.skeleton.limits.copy()
    limits[joint, CHANNELS.index(channel.lower())] = math.radians(low), math.radians(high)
    limited = replace(chosen.skeleton, limits=limits)
    try:
        check_initial(limited)
    except InputError as error:
        raise arguments.error(error.message) from None
    chosen.skeleton = limited


@command(
    "INITIAL",
    syntax="INITIAL <joint> <FLEXION/PIVOT/TWISTING/ABDUCTION> <degrees>",
    help="Angle of a joint in the rest pose of the file; limits, keys and inflation count from the straight joint.",
    group="Actors",
)
def initial(scene: Scene, arguments: Arguments) -> None:
    """Set the angle that a joint has in the rest pose of the file; angles count from the straight joint (R25)."""
    chosen, joint = read_joint(scene, arguments)
    channel = arguments.choice("the angle", [c.upper() for c in CHANNELS])
    degrees = arguments.number("the angle at rest in degrees", minimum=-360, maximum=360)
    if chosen.recorded is not None or chosen.keyed:
        raise arguments.error(
            f"actor {chosen.name} is in motion already: INITIAL comes before its keys and its MOTION",
            arguments.position,
        )
    angles = chosen.skeleton.initial.copy()
    angles[joint, CHANNELS.index(channel.lower())] = math.radians(degrees)
    bent = replace(chosen.skeleton, initial=angles)
    try:
        check_initial(bent)
    except InputError as error:
        change = f"LIMIT {chosen.skeleton.names[joint]} {channel} <smallest> <largest> changes that"
        raise arguments.error(f"{error.message}; {change}") from None
    chosen.skeleton = bent


def _options(arguments: Arguments) -> dict[str, object]:
    """Read the options of a rig file: keyword arguments of ``load_rig``, and ``name`` of the actor."""
    options = arguments.options(
        unit=lambda: _unit(arguments),
        scale=lambda: arguments.number("the scale", above=0.0),
        map=lambda: arguments.input_file("a joint map"),
        name=lambda: arguments.new_name("the actor's name"),
    )
    if "map" in options:
        options["joint_map"] = options.pop("map")
    metres = options.get("unit")
    if isinstance(metres, float):  # a unit in metres is a scale
        options["unit"], options["scale"] = "m", metres * float(str(options.get("scale", 1.0)))
    return options


def _unit(arguments: Arguments) -> str | float:
    """Read a unit: one of ``METRES`` in lower case, or its length [m]."""
    if arguments.has_number():
        return arguments.number("the unit in metres", above=0.0)
    return arguments.choice("the unit, or its length in metres", [u.upper() for u in METRES]).lower()


def _load(path: object, **options: object) -> Rig:
    from warpjld.io.kept_rig import kept_rig

    return kept_rig(path, **options)  # type: ignore[arg-type]
