"""Menu and entry of every command in the studio: by its group, or as its author chose (R88)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from warpjld.errors import InputError
from warpjld.script.registry import Command, Function

__all__ = ["MENUS", "menu", "place_in_menus"]

MENUS = ("File", "Edit", "Pose", "Hand", "Objects", "Grasp", "Contact", "View", "Help")
"""Menus in display order; menus that user commands add come after them."""

_OF_GROUP = {
    "Actors": "Hand",
    "Covering": "Hand",
    "Animation": "Pose",
    "Grasping": "Grasp",
    "Contact": "Contact",
    "Output": "File",
    "Flow": "Edit",
}
_OF_COMMAND = {
    **dict.fromkeys(("OBJECT", "OBJECTS", "MOVE", "TURN", "DEFORM"), "Objects"),
    **dict.fromkeys(("CAMERA", "SIZE", "LIGHT", "BACKDROP", "COLOR", "SHOT"), "View"),
    **dict.fromkeys(("HELP", "SHOW"), "Help"),
}

_F = TypeVar("_F", bound=Function)
_chosen: dict[Function, tuple[str, str]] = {}


def menu(place: str) -> Callable[[_F], _F]:
    """Decorator: choose the menu and entry of a command in the studio; used above or below ``@command``.

    Args:
        place: ``Menu/Entry``, such as ``"Pose/My trick"``; a menu that does not exist is added.

    Raises:
        InputError: Not of that form.

    Examples:
        >>> @wj.menu("Pose/Wave once")
        ... @wj.command("WAVE", syntax="WAVE <key>", help="Wave once from a key on.")
        ... def wave(scene: wj.Scene, arguments: wj.Arguments) -> None:
        ...     key = arguments.number("the key")
        ...     arguments.interpreter.run_text(f"FINGER1 LEFT INDEX FLEXION AT {key} 30", "<WAVE>")
        >>> from warpjld.script import all_commands
        >>> all_commands().remove("WAVE")
    """
    name, _, entry = (part.strip() for part in place.partition("/"))
    if not name or not entry or "/" in entry:
        raise InputError(f"menu '{place}': want 'Menu/Entry', such as 'Pose/My trick'")

    def put(function: _F) -> _F:
        _chosen[function] = (name, entry)
        return function

    return put


def place_in_menus(command: Command) -> tuple[str, str]:
    """Menu and entry of a command."""
    if command.run in _chosen:
        return _chosen[command.run]
    name = _OF_COMMAND.get(command.name) or _OF_GROUP.get(command.group, command.group)
    return name, command.name
