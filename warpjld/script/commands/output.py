"""Commands for the camera and for the files to write: pictures, films, contact sheets, exports."""

from __future__ import annotations

import math
from dataclasses import astuple, replace
from typing import cast

from warpjld.script.arguments import Arguments
from warpjld.script.formats import EXPORTS, FILMS, MOTIONS, PICTURES, VIEW_WORDS
from warpjld.script.keys import DIGIT_WORDS
from warpjld.script.outputs import (
    CameraKey,
    CameraSetting,
    ContactSheet,
    Export,
    FilmOutput,
    MotionFile,
    Output,
    Picture,
    PictureStyle,
    Shot,
)
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.suggest import did_you_mean

_STYLES = ("SHADED", "WIREFRAME", "PRESSURE")
_SHOWN = "[SHADED/WIREFRAME/PRESSURE [<actor or object> [THUMB/INDEX/MIDDLE/RING/PINKY/PALM …]]]"


@command(
    "CAMERA",
    syntax=(
        f"CAMERA <{'/'.join(VIEW_WORDS)}> [ZOOM <factor>] [FOLLOW] or CAMERA FROM <x> <y> <z> TO <x> <y> <z> "
        "[ROLL <degrees>] [AT <frame>] …"
    ),
    help="Camera of the pictures and films after this line [m]; FOLLOW: it moves with the first actor; AT sets keys.",
    group="Output",
)
def camera(scene: Scene, arguments: Arguments) -> None:
    """Camera of the pictures and films after this line [m]; FOLLOW moves it with the first actor (R5)."""
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
        zoom=lambda: arguments.number("the zoom factor", minimum=0.01, maximum=100),
        follow=lambda: True,
        roll=lambda: math.radians(arguments.number("the roll in degrees", minimum=-3600.0, maximum=3600.0)),
        at=lambda: arguments.number("the key (a frame)"),
    )
    zoom, roll = (float(cast(float, options.get(name, value))) for name, value in (("zoom", 1.0), ("roll", 0.0)))
    if position is None or target is None:
        if {"roll", "at"} & set(options):
            raise arguments.error("ROLL and AT are for a camera FROM a place")
        scene.camera = CameraSetting(view, zoom=zoom, follow="follow" in options)
        return
    made = CameraSetting(None, position, target, zoom, follow="follow" in options, roll=roll)
    if "at" in options:
        key = CameraKey(float(cast(float, options["at"])), position, target, zoom, roll, astuple(scene.spline))
        made = replace(made, keys=_with_key(scene, key))
    scene.camera = made


def _with_key(scene: Scene, key: CameraKey) -> tuple[CameraKey, ...]:
    """The camera's keys with one more; after a SHOT has used the camera, a new sequence of keys begins."""
    taken = any(shot.camera is scene.camera for shot in scene.shots.values())
    others = () if taken else tuple(other for other in scene.camera.keys if other.frame != key.frame)
    return tuple(sorted((*others, key), key=lambda each: each.frame))


@command(
    "SIZE",
    syntax="SIZE <width> <height>",
    help="Size of pictures and films in pixels; 960 by 720 by default.",
    group="Output",
)
def size(scene: Scene, arguments: Arguments) -> None:
    """Size of pictures and films in pixels; 960 by 720 by default (R67)."""
    width = arguments.integer("the width in pixels", minimum=16, maximum=4096)
    scene.size = width, arguments.integer("the height in pixels", minimum=16, maximum=4096)


@command(
    "PICTURE",
    syntax=f'PICTURE <frame> "<name>.png" {_SHOWN[:-1]}/NUMBERS [<actor or object>]]',
    help="A picture of a frame; PRESSURE colours contact pressure; NUMBERS shows the files' vertex and facet numbers.",
    group="Output",
)
def picture(scene: Scene, arguments: Arguments) -> None:
    """A picture of a frame; PRESSURE colours all, or one actor, digit or object (R5, R66, R67)."""
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
    syntax=f'FILM "<name>{"/".join(FILMS)}" [SHOTS <shot> …] {_SHOWN}',
    help="A film of all frames, or of shots, each after the one before in time.",
    group="Output",
)
def film(scene: Scene, arguments: Arguments) -> None:
    """A film of all frames (R67)."""
    name = arguments.output_name("the film's name", FILMS)
    shots = _shots(scene, arguments) if arguments.keyword("SHOTS") else ()
    style = _style(arguments)
    only, digits = _only(scene, arguments, style)
    ask_for(scene, arguments, FilmOutput(name, style, scene.camera, only, digits, shots))


def _shots(scene: Scene, arguments: Arguments) -> tuple[Shot, ...]:
    """Read the shots of a film; their frames must increase, since frames are computed in order."""
    out: list[Shot] = []
    while (name := arguments.keyword(*scene.shots)) is not None:
        shot = scene.shots[name]
        if out and shot.first <= out[-1].last:
            raise arguments.error(
                f"shot {name} begins at frame {shot.first}, before {out[-1].name} has ended ({out[-1].last}): shots "
                "of a film follow one another"
            )
        out.append(shot)
    if not out:
        known = ", ".join(scene.shots) or "none"
        raise arguments.error(f"SHOTS needs names of shots; there are {known}: SHOT <name> <first> <last> makes one")
    after = arguments.next_word()
    if after is not None and after.upper() not in _STYLES:
        raise arguments.expected(f"a shot ({'/'.join(scene.shots)}) or the style ({'/'.join(_STYLES)})")
    return tuple(out)


@command(
    "CONTACT",
    syntax='CONTACT "<name>.png" [<frame> …]',
    help="A contact sheet: frames side by side, as wire-frame and shaded; the key frames if none are listed.",
    group="Output",
)
def contact(scene: Scene, arguments: Arguments) -> None:
    """A contact sheet: frames side by side, as wire-frame and shaded; the key frames if none are listed (R67)."""
    name = arguments.output_name("the sheet's name", PICTURES)
    frames = []
    while arguments:
        frames.append(arguments.number("a frame"))
    ask_for(scene, arguments, ContactSheet(name, tuple(frames), scene.camera))


@command(
    "EXPORT",
    syntax=f'EXPORT "<name>{"/".join(EXPORTS)}" [<actor>]',
    help="The animated surface of an actor; if none is named, of all actors, one file each.",
    group="Output",
)
def export(scene: Scene, arguments: Arguments) -> None:
    """The animated surface of an actor; if none is named, of all actors, one file each (R89)."""
    name = arguments.output_name("the file's name", EXPORTS)
    actor = scene.actor(arguments.name("an actor's name")).name if arguments else None
    ask_for(scene, arguments, Export(name, actor))


@command(
    "EXPORT_MOTION",
    syntax=f'EXPORT_MOTION "<name>{"/".join(MOTIONS)}" [<actor>]',
    help="The motion of an actor on its rig's own joints; if none is named, of all actors, one file each.",
    group="Output",
)
def export_motion(scene: Scene, arguments: Arguments) -> None:
    """The motion of an actor on its rig's own joints; if none is named, of all actors, one file each (R89)."""
    name = arguments.output_name("the file's name", MOTIONS)
    actor = scene.actor(arguments.name("an actor's name")).name if arguments else None
    ask_for(scene, arguments, MotionFile(name, actor))


def _style(arguments: Arguments, *beside: str) -> PictureStyle:
    return cast(PictureStyle, arguments.choice("the style", _STYLES, beside).lower()) if arguments else "shaded"


def _only(scene: Scene, arguments: Arguments, style: PictureStyle) -> tuple[str | None, tuple[str, ...]]:
    """Read which actor or object is coloured alone, and which of its digits; None and () for all."""
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
    """Add a file to the scene's outputs.

    Raises:
        InputError: There is an output of that name already.
    """
    if any(other.name.lower() == output.name.lower() for other in scene.outputs):
        raise arguments.error(f"'{output.name}' is asked for twice")
    scene.outputs.append(output)
    at = arguments.position
    scene.asked[output.name] = (at.path, at.line, at.column)
