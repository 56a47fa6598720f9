"""Commands for lamps, backdrop, colours and shots (A8, R89, R135)."""

from __future__ import annotations

from dataclasses import astuple
from typing import cast

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.directing import KeyedLamp
from warpjld.script.outputs import Shot
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.suggest import did_you_mean

_KINDS = {"KEY": 0.9, "FILL": 0.35, "DIRECTIONAL": 0.7}
"""Kinds of lamps and their default intensity, chosen by eye."""


@command(
    "LIGHT",
    syntax=(
        'LIGHT <name> <KEY/FILL/DIRECTIONAL> FROM <x> <y> <z> [TO <x> <y> <z>] [COLOR "<colour>"] '
        "[INTENSITY <share>] [AT <frame>]"
    ),
    help="Add a lamp [m]; lamps replace the default lighting. AT sets keys of its position and intensity.",
    group="Output",
)
def light(scene: Scene, arguments: Arguments) -> None:
    """Add a lamp; lamps replace the default lighting (R135)."""
    name = arguments.name("the lamp's name").upper()
    kind = arguments.choice("the kind of lamp", _KINDS)
    arguments.choice("FROM and the lamp's place", ("FROM",))
    place = arguments.vector("the lamp's")
    options = arguments.options(
        to=lambda: arguments.vector("the target's"),
        color=lambda: read_color(arguments),
        intensity=lambda: arguments.number("the intensity", minimum=0.0, maximum=10.0),
        at=lambda: arguments.number("the key (a frame)"),
    )
    target = cast("tuple[float, float, float]", options.get("to", (0.0, 0.0, 0.0)))
    if place == target:
        raise arguments.error("a lamp cannot shine at its own place")
    known = scene.lamps.get(name)
    if known is None or "at" not in options:
        known = KeyedLamp("#ffffff", kind == "DIRECTIONAL")
        scene.lamps[name] = known
    known.color, known.parallel = str(options.get("color", known.color)), kind == "DIRECTIONAL"
    values = dict(zip(("px", "py", "pz", "tx", "ty", "tz"), (*place, *target), strict=True))
    values["intensity"] = float(cast(float, options.get("intensity", _KINDS[kind])))
    known.set(float(cast(float, options.get("at", 0.0))), values, astuple(scene.spline))


@command(
    "BACKDROP",
    syntax='BACKDROP "<colour>" ["<colour above>"] or BACKDROP PICTURE "<picture file>"',
    help="Background of pictures and films: one colour, a vertical gradient of two, or a picture file.",
    group="Output",
)
def backdrop(scene: Scene, arguments: Arguments) -> None:
    """Background of pictures and films (R135)."""
    if arguments.keyword("PICTURE"):
        from warpjld.render.backdrop import check_backdrop

        path = arguments.input_file("a picture file")
        try:
            check_backdrop(path)
        except InputError as error:
            raise arguments.error(error.message) from None
        scene.backdrop_picture = path
        return
    scene.backdrop_picture = None
    below = read_color(arguments)
    scene.backdrop = below, read_color(arguments) if arguments else below


@command(
    "COLOR",
    syntax='COLOR <actor or object> "<colour>"',
    help="Colour of an actor's skin or of an object.",
    group="Output",
)
def color(scene: Scene, arguments: Arguments) -> None:
    """Colour of an actor's skin or of an object (R135)."""
    name = arguments.name("an actor's or an object's name").upper()
    chosen = read_color(arguments)
    if name in scene.props:
        scene.props[name].color, scene.props[name].colored = chosen, True
    elif name in scene.actors:
        scene.actors[name].color = chosen
    else:
        raise arguments.error(f"there is no actor or object {name}{did_you_mean(name, [*scene.actors, *scene.props])}")


@command(
    "SHOT",
    syntax="SHOT <name> <first> <last>",
    help="Define a shot: a range of frames seen by the CAMERA set before. FILM … SHOTS shows shots in order.",
    group="Output",
)
def shot(scene: Scene, arguments: Arguments) -> None:
    """Define a shot: a range of frames seen by the camera set before (R135)."""
    name = arguments.new_name("the shot's name").upper()
    first, last = arguments.integer("the first frame"), arguments.integer("the last frame")
    if last < first:
        raise arguments.error(f"the last frame must not come before the first ({first}), got {last}")
    if name in scene.shots:
        raise arguments.error(f"there is a shot {name} already")
    scene.shots[name] = Shot(name, first, last, scene.camera)


def read_color(arguments: Arguments) -> str:
    """Read a colour; as ``#rrggbb``."""
    from warpjld.render.colors import as_hex

    name = arguments.text("a colour")
    try:
        return as_hex(name)
    except InputError as error:
        raise arguments.error(error.message) from None
