"""Commands INCLUDE, PRINT, SHOW and HELP. MACRO … END is part of the grammar."""

from __future__ import annotations

from contextlib import suppress

from warpjld.errors import InputError
from warpjld.script import show
from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import read_object
from warpjld.script.facets import read_facet, read_vertex
from warpjld.script.registry import all_commands, command
from warpjld.script.scene import Scene
from warpjld.script.statements import Word

_TOPICS = (
    "VALUES",
    "WIREFRAME",
    "SHADED",
    "DISTANCE",
    "INTERSECTION",
    "ACTORS",
    "JOINTS",
    "PARAMETERS",
    "OUTPUTS",
)


@command(
    "INCLUDE",
    syntax='INCLUDE "<script>"',
    help="Run another script here; its name is relative to this script's folder.",
    group="Flow",
)
def include(scene: Scene, arguments: Arguments) -> None:
    """Run another script here; its name is relative to this script's folder (R88)."""
    path = arguments.input_file("a script")
    arguments.interpreter.include(path, arguments.last)


@command("PRINT", syntax='PRINT <word, number or "text"> …', help="Write a message.", group="Flow")
def print_(scene: Scene, arguments: Arguments) -> None:
    """Write a message (R88)."""
    words = []
    while arguments:
        value = arguments.anything()
        words.append(str(value) if not hasattr(value, "text") else value.text)
    scene.say(" ".join(words))


@command(
    "SHOW",
    syntax=(
        "SHOW VALUES <frame>, SHOW <WIREFRAME/SHADED> <frame>, SHOW DISTANCE <frame> <hand vertex> <object> <facet>, "
        "SHOW INTERSECTION <frame> <segment> <object> or SHOW <ACTORS/JOINTS/PARAMETERS/OUTPUTS>"
    ),
    help="Print joint values at a frame, make a picture of it, measure a distance or an intersection, or list names.",
    group="Flow",
)
def show_(scene: Scene, arguments: Arguments) -> None:
    """Print values at a frame, make a picture of it (prints its path), measure, or list what there is (R4, R5)."""
    topic = arguments.choice("what to show", _TOPICS)
    match topic:
        case "VALUES":
            frame = arguments.number("the frame")
            scene.actor()  # raises an error with advice if there is none
            for actor in scene.actors.values():
                scene.say(show.values(actor, frame, scene.rate))
        case "WIREFRAME" | "SHADED":
            from warpjld.script.pictures import preview

            frame = arguments.number("the frame")
            scene.actor()  # raises an error with advice if there is none
            scene.say(str(preview(scene, frame, "shaded" if topic == "SHADED" else "wireframe")))
        case "DISTANCE" | "INTERSECTION":
            _measure(scene, arguments, topic)
        case "ACTORS":
            scene.say(show.actors(scene))
        case "JOINTS":
            scene.say(show.joints(scene.actor()))
        case "PARAMETERS":
            scene.say(show.parameter_listing(scene.actor()))
        case "OUTPUTS":
            scene.say("\n".join(output.name for output in scene.outputs) or "nothing asked for yet")


def _measure(scene: Scene, arguments: Arguments, topic: str) -> None:
    """Print the distance of a vertex to a facet, or the intersection of a segment with an object (R73, R75, R132)."""
    from warpjld.script import measures

    frame = arguments.number("the frame")
    actor = scene.actor()
    if topic == "DISTANCE":
        vertex = read_vertex(actor, arguments, "the hand vertex (its number in the file)")
        prop = read_object(scene, arguments)
        facet = read_facet(prop, arguments, "the facet (its number in the file)")
        if not scene.dry:
            scene.say(measures.distance(scene, actor, frame, vertex, prop, facet))
        return
    segment, where = arguments.name("a segment or a digit"), arguments.last
    side = segment.lower().partition(".")[0]
    if side in ("left", "right") and segment.lower() != side:
        with suppress(InputError):  # what the current actor does not have is told below
            actor = scene.actor_with(side)
    prop = read_object(scene, arguments)
    if scene.dry:
        return
    try:
        scene.say(measures.intersection_text(scene, actor, frame, segment, prop))
    except InputError as error:
        raise arguments.error(error.message, where) from None


@command("HELP", syntax="HELP [<command>]", help="List all commands, or explain one.", group="Flow")
def help_(scene: Scene, arguments: Arguments) -> None:
    """List all commands, or explain one (R88)."""
    if not arguments:
        scene.say(show.command_listing(all_commands()))
        return
    value = arguments.anything()
    if not isinstance(value, Word):
        raise arguments.error("expected a command's name")
    try:
        found = all_commands()[value.text]
    except InputError as error:
        raise arguments.error(error.message) from None
    scene.say(f"{found.syntax}\n  {found.help}")
