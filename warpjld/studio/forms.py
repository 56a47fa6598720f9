"""Forms of commands and macros: ways to call them, known names, and initial values for the present scene."""

from __future__ import annotations

from warpjld.script.registry import Command
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition
from warpjld.studio.syntax import TextField, Way, ways_of

__all__ = ["first_value", "known_names", "ways_of_command", "ways_of_macro"]

_FIRST, _LAST = ("key", "key1", "frame", "first", "start"), ("key2", "last", "other key", "stop")
_LONG = 20.0  # default distance between the first and the second key of a form [frames]


def ways_of_command(command: Command) -> tuple[Way, ...]:
    """The ways to call a command."""
    return ways_of(command.name, command.syntax)


def ways_of_macro(macro: MacroDefinition) -> tuple[Way, ...]:
    """The one way to call a macro: a value for each parameter."""
    return (Way(tuple(TextField(word.text.lower()) for word in macro.parameters)),)


def known_names(field: TextField, scene: Scene) -> list[str]:
    """Names in the scene that a field may take; empty if any text is allowed."""
    actors, objects = [*scene.actors], [*scene.props]
    match field.label:
        case "actor or object":
            return [*actors, *objects]
        case "actor":
            return actors
        case "object":
            return objects
        case "joint" | "joint or ALL":
            joints = [name for actor in scene.actors.values() for name in actor.skeleton.names]
            return [*(["ALL"] if "ALL" in field.label else []), *dict.fromkeys(joints)]
        case _:
            return []


def first_value(field: TextField, frame: float) -> float:
    """Initial value of a number: the current frame for a first key, a later one for a second key, else a default."""
    if field.label in _LAST:
        return frame + _LONG
    return frame if field.label in _FIRST else 0.0
