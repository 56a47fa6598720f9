"""The camera, and files to make."""

from __future__ import annotations

from typing import cast

from warpjld.script.arguments import Arguments
from warpjld.script.formats import EXPORTS, FILMS, MOTIONS, PICTURES, VIEW_WORDS
from warpjld.script.keys import DIGIT_WORDS
from warpjld.script.outputs import (
    CameraSetting,
    ContactSheet,
    Export,
    FilmOutput,
    MotionFile,
    Output,
    Picture,
    PictureStyle,
)
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.suggest import did_you_mean

_STYLES = ("SHADED", "WIREFRAME", "PRESSURE")
_SHOWN = "[SHADED/WIREFRAME/PRESSURE [<actor or object> [THUMB/INDEX/MIDDLE/RING/PINKY/PALM …]]]"


@command(
    "CAMERA",
    syntax=f"CAMERA <{'/'.join(VIEW_WORDS)}> [ZOOM <factor>] [FOLLOW] or CAMERA FROM <x> <y> <z> TO <x> <y> <z> …",
    help="Where the pictures and films after this line are taken from [m]; FOLLOW goes along with the first actor.",
    group="Output",
)
def camera(scene: Scene, arguments: Arguments) -> None:
    """Where the pictures and films after this line are taken from [m]; FOLLOW goes along with the first actor (R5)."""
    view, position, target = None, None, None
    if arguments.keyword("FROM"):
        position = arguments.vector("the camera's")
        arguments.choice("", ("TO",))
        target = arguments.vector("the target's")
        if position == target:
            raise arguments.error("the camera cannot look at its own place")
    else:
        view = arguments.choice("a view or FROM", VIEW_WORDS).lower()
    options = arguments.options(
        zoom=lambda: arguments.number("the zoom factor", minimum=0.01, maximum=100), follow=lambda: True
    )
    zoom = cast(float, options.get("zoom", 1.0))
    scene.camera = CameraSetting(view, position, target, zoom, follow="follow" in options)


@command(
    "SIZE",
    syntax="SIZE <width> <height>",
    help="Pixels of the pictures and films; 960 by 720 at first.",
    group="Output",
)
def size(scene: Scene, arguments: Arguments) -> None:
    """Pixels of the pictures and films; 960 by 720 at first (R67)."""
    width = arguments.integer("the width in pixels", minimum=16, maximum=4096)
    scene.size = width, arguments.integer("the height in pixels", minimum=16, maximum=4096)


@command(
    "PICTURE",
    syntax=f'PICTURE <frame> "<name>.png" {_SHOWN[:-1]}/NUMBERS [<actor or object>]]',
    help="A picture of a frame; PRESSURE colours what touches; NUMBERS are the files' own, of vertices and facets.",
    group="Output",
)
def picture(scene: Scene, arguments: Arguments) -> None:
    """A picture of a frame; PRESSURE colours what touches: all, or one actor, digit or object alone (R5, R66, R67)."""
    frame = arguments.number("the frame")
    name = arguments.output_name("the picture's name", PICTURES)
    if arguments.keyword("NUMBERS"):
        only = _shown_alone(scene, arguments) if arguments else None
        ask_for(scene, arguments, Picture(name, frame, "shaded", scene.camera, only, numbers=True))
        return
    style = _style(arguments, "NUMBERS")
    ask_for(scene, arguments, Picture(name, frame, style, scene.camera, *_only(scene, arguments, style)))


@command(
    "FILM",
    syntax=f'FILM "<name>{"/".join(FILMS)}" {_SHOWN}',
    help="A film of all frames.",
    group="Output",
)
def film(scene: Scene, arguments: Arguments) -> None:
    """A film of all frames (R67)."""
    name = arguments.output_name("the film's name", FILMS)
    style = _style(arguments)
    ask_for(scene, arguments, FilmOutput(name, style, scene.camera, *_only(scene, arguments, style)))


@command(
    "CONTACT",
    syntax='CONTACT "<name>.png" [<frame> …]',
    help="A contact sheet: frames side by side, as wire-frame and shaded; key frames unless listed.",
    group="Output",
)
def contact(scene: Scene, arguments: Arguments) -> None:
    """A contact sheet: frames side by side, as wire-frame and shaded; key frames unless listed (R67)."""
    name = arguments.output_name("the sheet's name", PICTURES)
    frames = []
    while arguments:
        frames.append(arguments.number("a frame"))
    ask_for(scene, arguments, ContactSheet(name, tuple(frames), scene.camera))


@command(
    "EXPORT",
    syntax=f'EXPORT "<name>{"/".join(EXPORTS)}" [<actor>]',
    help="The animated surface of an actor; of all, each in a file of its own, if none is named.",
    group="Output",
)
def export(scene: Scene, arguments: Arguments) -> None:
    """The animated surface of an actor; of all, each in a file of its own, if none is named (R89)."""
    name = arguments.output_name("the file's name", EXPORTS)
    actor = scene.actor(arguments.name("an actor's name")).name if arguments else None
    ask_for(scene, arguments, Export(name, actor))


@command(
    "EXPORT_MOTION",
    syntax=f'EXPORT_MOTION "<name>{"/".join(MOTIONS)}" [<actor>]',
    help="The motion of an actor on its rig's own joints; of all, each in a file of its own, if none is named.",
    group="Output",
)
def export_motion(scene: Scene, arguments: Arguments) -> None:
    """The motion of an actor on its rig's own joints; of all, each in a file of its own, if none is named (R89)."""
    name = arguments.output_name("the file's name", MOTIONS)
    actor = scene.actor(arguments.name("an actor's name")).name if arguments else None
    ask_for(scene, arguments, MotionFile(name, actor))


def _style(arguments: Arguments, *beside: str) -> PictureStyle:
    return cast(PictureStyle, arguments.choice("the style", _STYLES, beside).lower()) if arguments else "shaded"


def _only(scene: Scene, arguments: Arguments, style: PictureStyle) -> tuple[str | None, tuple[str, ...]]:
    """What is shown alone, and which digits of it."""
    if style != "pressure" or not arguments:
        return None, ()
    name = _shown_alone(scene, arguments)
    digits: list[str] = []
    while name in scene.actors and arguments:
        digits.append(arguments.choice("a digit", (*DIGIT_WORDS, "PALM")).lower())
    if digits and name not in scene.contact.flesh:
        raise arguments.error(f"{name} has no flesh whose digits can be shown: FLESH {name} makes it so")
    return name, tuple(dict.fromkeys(digits))


def _shown_alone(scene: Scene, arguments: Arguments) -> str:
    name = arguments.name("an actor's or an object's name").upper()
    known = [*scene.actors, *scene.props]
    if name not in known:
        raise arguments.error(f"there is no actor or object {name}{did_you_mean(name, known)}")
    return name


def ask_for(scene: Scene, arguments: Arguments, output: Output) -> None:
    """Note a file to make."""
    if any(other.name.lower() == output.name.lower() for other in scene.outputs):
        raise arguments.error(f"'{output.name}' is asked for twice")
    scene.outputs.append(output)
    at = arguments.position
    scene.asked[output.name] = (at.path, at.line, at.column)
