"""Commands that add objects to the scene (OBJECT) and attach them to joints (OBJECTS) (A §7)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from warpjld.errors import InputError
from warpjld.geometry.lengths import check_size
from warpjld.script.arguments import Arguments
from warpjld.script.commands.modelling import modelled
from warpjld.script.commands.physical import read_object
from warpjld.script.keys import DIGIT_WORDS, SIDES, named_joint, read_joint
from warpjld.script.registry import command
from warpjld.script.scene import Scene

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject

_SHAPES = ("BALL", "BOX", "CYLINDER", "PLATE", "GLASS")
_MODELLED = ("REVOLVE", "SWEEP", "SOFT")


@command(
    "OBJECT",
    syntax=(
        'OBJECT <name> <BALL/BOX/CYLINDER/PLATE/GLASS> [<metres> …] or OBJECT <name> "<surface or volume file>" '
        "[UNIT <M/CM/MM/…>] [UP <X/Y/Z>] [CENTRE] or OBJECT <name> REVOLVE <radius> <y> … or "
        "OBJECT <name> SWEEP <u> <v> … ALONG <x> <y> <z> … or OBJECT <name> SOFT <x> <y> <z> <radius> …, "
        "then [SCALE <factor>] [AT <x> <y> <z>] [TURN <x> <y> <z>] "
        '[COLOR "<colour>"]'
    ),
    help="Add an object [m]: a shape, a surface file (.npz: animated), a surface of revolution, a sweep, a soft one.",
    group="Grasping",
)
def object_(scene: Scene, arguments: Arguments) -> None:
    """Add an object to the scene (A §7)."""
    from scipy.spatial.transform import Rotation

    from warpjld.grasp.hand_scale import doubt_of_size, hand_length
    from warpjld.grasp.keyframes import load_keyframes
    from warpjld.grasp.object_file import UNITS
    from warpjld.script.props import COLORS, Prop

    name = arguments.new_name("the object's name").upper()
    if name in scene.props or name in scene.actors:
        raise arguments.error(f"there is an object or actor {name} already")
    shape, sizes, path, made = None, [], None, None
    if arguments.has_text():
        path = arguments.input_file("a surface file")
    else:
        shape = arguments.choice("a shape, or a surface file in quotes", (*_SHAPES, *_MODELLED)).lower()
        if shape.upper() in _MODELLED:
            made = modelled(arguments, shape, name.lower())
        while made is None and arguments.has_number():
            sizes.append(arguments.number("a size in metres", above=0.0, maximum=100.0))
    where = arguments.last
    options = arguments.options(
        unit=lambda: arguments.choice("the unit", [u.upper() for u in UNITS]).lower(),
        up=lambda: arguments.choice("the axis that points up", ("X", "Y", "Z")).lower(),
        centre=lambda: True,
        scale=lambda: arguments.number("the scale", above=0.0),
        at=lambda: arguments.vector("the place's"),
        turn=lambda: arguments.vector("the rotation about"),
        color=lambda: _color(arguments),
    )
    if path is None and {"unit", "up", "centre"} & set(options):
        raise arguments.error("UNIT, UP and CENTRE are for surfaces from files", where)
    shapes = None
    try:
        if path is not None and path.suffix.lower() == ".npz":
            if {"unit", "up", "centre"} & set(options):
                raise InputError("an animated surface is in metres with Y up: UNIT, UP and CENTRE are not for it")
            shapes = load_keyframes(path, name=name.lower(), scale=float(cast(float, options.get("scale", 1.0))))
            thing = shapes.thing
        else:
            scale = float(cast(float, options.get("scale", 1.0)))
            thing = made.scaled(scale) if made is not None else _made(name.lower(), shape, sizes, path, options)
    except TypeError:
        raise arguments.error(f"too many sizes for a {str(shape).upper()}", where) from None
    except InputError as error:
        raise arguments.error(str(error), where) from None
    try:
        check_size(thing.vertices, f"object {name}", "SCALE or UNIT")
    except InputError as error:
        raise arguments.error(error.message, where) from None
    turn = Rotation.from_euler("xyz", np.radians(cast(tuple, options.get("turn", (0.0, 0.0, 0.0)))))
    thing = thing.placed(cast(tuple, options.get("at", (0.0, 0.0, 0.0))), turn.as_quat())
    color = str(options.get("color", COLORS[len(scene.props) % len(COLORS)]))
    assumed = "m" if path is not None and shapes is None and "unit" not in options else None
    scene.props[name] = Prop(name, thing, color, shapes=shapes, assumed=assumed, colored="color" in options)
    if path is not None:
        unit = None if shapes is not None else str(options.get("unit", "m"))
        hands = [length for actor in scene.actors.values() if (length := hand_length(actor.skeleton))]
        doubt = doubt_of_size(thing, max(hands, default=None), unit)
        scene.warned([f"{name} {doubt}"] if doubt else [])


@command(
    "OBJECTS",
    syntax=(
        "OBJECTS <object> <THUMB/INDEX/MIDDLE/RING/PINKY> <LEFT/RIGHT> <KNUCKLES2/KNUCKLES3> <start> <stop> "
        "or OBJECTS <object> JOINT <joint> <start> <stop>"
    ),
    help="Attach an object to a joint from one frame to another; before and after it does not move.",
    group="Grasping",
)
def objects(scene: Scene, arguments: Arguments) -> None:
    """Attach an object to a joint from one frame to another (R69–R72, R85, C14)."""
    from warpjld.grasp.attach import Association

    prop = read_object(scene, arguments)
    if arguments.keyword("JOINT"):
        actor, joint = read_joint(scene, arguments)
    else:
        finger, side, knuckle = arguments.choices(DIGIT_WORDS, SIDES, ("KNUCKLES2", "KNUCKLES3"))
        actor = scene.actor_with(side)
        joint = named_joint(actor, f"{side}.{finger}.{knuckle.replace('KNUCKLES', 'knuckle')}", arguments)
    start = arguments.number("the starting time (a frame)")
    stop = arguments.number("the stopping time (a frame)")
    if stop < start:
        raise arguments.error(f"the stopping time must not come before the starting time ({start:g}), got {stop:g}")
    for other in prop.associations:
        if start < other.stop and other.start < stop:
            taken = f"{other.start:g} to {other.stop:g}"
            raise arguments.error(f"{prop.name} follows another joint from {taken} already")
    prop.associations.append(Association(actor.name, joint, start, stop))


def _color(arguments: Arguments) -> str:
    from warpjld.render.colors import as_hex

    name = arguments.text("a colour")
    try:
        return as_hex(name)
    except InputError as error:
        raise arguments.error(error.message) from None


def _made(name: str, shape: str | None, sizes: list[float], path: object, options: dict[str, object]) -> GraspObject:
    from warpjld.grasp.object_file import load_object
    from warpjld.grasp.shapes import SHAPES
    from warpjld.simulation.volume_object import VOLUME_FILES, load_volume_object

    scale = float(cast(float, options.get("scale", 1.0)))
    if shape is not None:
        return SHAPES[shape](*sizes, name=name).scaled(scale)
    load = load_volume_object if Path(str(path)).suffix.lower() in VOLUME_FILES else load_object
    return load(
        Path(str(path)),
        name=name,
        unit=str(options.get("unit", "m")),
        up=cast(Literal["x", "y", "z"], options.get("up", "y")),
        scale=scale,
        centre="centre" in options,
    )
