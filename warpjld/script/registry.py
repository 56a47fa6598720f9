"""Registry of commands: built-in ones, those of installed packages, and those that users add in Python (R88).

A command is a function of the scene and its arguments::

    @command("SNAP", syntax="SNAP <LEFT/RIGHT> <key>", help="Snap thumb and middle finger at a key.")
    def snap(scene: Scene, arguments: Arguments) -> None: ...

An installed package registers its commands by an entry point in the group ``warpjld.commands`` that names a module
(or an object in one) whose import runs such decorators.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, TypeVar

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.script.arguments import Arguments
    from warpjld.script.scene import Scene

__all__ = [
    "GROUPS",
    "NOTES",
    "RESERVED",
    "Command",
    "Function",
    "Registry",
    "all_commands",
    "command",
    "commands_table",
]

ENTRY_POINTS = "warpjld.commands"
GROUPS = ("Actors", "Animation", "Grasping", "Contact", "Covering", "Output", "Flow")
"""Groups of the built-in commands, in the order of the table of commands."""

NOTES = {
    "Animation": (
        "`<key1> <key2> <step> <degrees>` sets the angle at key1, key1 + step, … up to key2; "
        "`AT <key> <degrees>` in its place sets a single key. "
        "The words of a command may stand in any order before its numbers."
    ),
    "Contact": (
        "Objects that are not PHYSICAL act as obstacles and are not moved by contact: rigid ones, animated surfaces, "
        "those changed by DEFORM. Displacements and deformations take keys as angles do, `AT <key>` included."
    ),
    "Flow": (
        "`MACRO <name> <parameter> … END` defines a command from the lines between; inside, `$parameter` is replaced "
        "by the argument of the call, also in quoted texts. Numbers may be arithmetic in parentheses: "
        "`($start + 2 * 5)`. `#` begins a comment. Upper and lower case are the same."
    ),
}
"""Notes on a group of commands, printed above its table."""

RESERVED = (
    *("MACRO", "END"),
    # a line that begins with one of these continues the command above it
    *("LEFT", "RIGHT", "FLEXION", "PIVOT", "TWISTING", "ABDUCTION", "KNUCKLES2", "KNUCKLES3"),
)
"""Words that cannot be names of commands or macros."""

_BUILT_IN = (
    "actors",
    "animation",
    "key_editing",
    "posing",
    "objects",
    "grasping",
    "reaching",
    "physical",
    "pieces",
    "deforming",
    "loading",
    "gripping",
    "pressing",
    "covering",
    "output",
    "directing",
    "flow",
)

Function = Callable[["Scene", "Arguments"], None]
_F = TypeVar("_F", bound=Function)


@dataclass(frozen=True)
class Command:
    """A command of the language.

    Attributes:
        name: Upper case, one word.
        syntax: One line: keywords in capitals, ``<value>``, ``[optional]``, ``A/B`` for a choice.
        help: One sentence.
        group: Group it is listed under.
        run: Function that executes it.
    """

    name: str
    syntax: str
    help: str
    group: str
    run: Function


class Registry:
    """Commands by name."""

    def __init__(self) -> None:
        self._commands: dict[str, Command] = {}

    def __iter__(self) -> Iterator[Command]:
        return iter(self._commands.values())

    def __contains__(self, name: str) -> bool:
        return name.upper() in self._commands

    def __getitem__(self, name: str) -> Command:
        """The command of that name, in any case.

        Raises:
            InputError: There is none; suggests the nearest.
        """
        try:
            return self._commands[name.upper()]
        except KeyError:
            raise InputError(f"there is no command {name}{did_you_mean(name, self._commands)}") from None

    def add(self, new: Command) -> None:
        """Add a command.

        Raises:
            InputError: The name is taken by another function, reserved, or not a single word.
        """
        if not new.name.replace("_", "a").isalnum() or new.name[0].isdigit():
            raise InputError(f"command name '{new.name}': want one word of letters, digits and underscores")
        old = self._commands.get(new.name)
        same = old and (old.run.__module__, old.run.__qualname__) == (new.run.__module__, new.run.__qualname__)
        if new.name in RESERVED:
            raise InputError(f"{new.name} is a word of the language: choose another name for the command")
        if old and not same:
            raise InputError(f"there is a command {new.name} already")
        self._commands[new.name] = new

    def remove(self, name: str) -> None:
        """Remove a command."""
        del self._commands[self[name].name]


_registry = Registry()
_loaded = False


def command(name: str, *, syntax: str, help: str, group: str = "User") -> Callable[[_F], _F]:
    """Decorator: add a command to the language.

    Args:
        name: The word that calls it, in any case.
        syntax: One line, shown in tables and error messages.
        help: One sentence, shown in tables.
        group: Group to list it under.

    Raises:
        InputError: There is a command of that name already.

    Examples:
        >>> @wj.command("SPREAD", syntax="SPREAD <key> <degrees>", help="Spread index and ring finger.")
        ... def spread(scene: wj.Scene, arguments: wj.Arguments) -> None:
        ...     key, degrees = arguments.number("the key"), arguments.number("the angle")
        ...     for finger, way in (("INDEX", 1), ("RING", -1)):
        ...         line = f"FINGER1 LEFT {finger} ABDUCTION AT {key} {way * degrees}"
        ...         arguments.interpreter.run_text(line, "<SPREAD>")
        >>> from warpjld.script import all_commands
        >>> all_commands().remove("SPREAD")
    """

    def register(function: _F) -> _F:
        _registry.add(Command(name.upper(), syntax, help, group, function))
        return function

    return register


def all_commands() -> Registry:
    """All commands: built-in ones, then those of installed packages; one that cannot be loaded causes a warning."""
    global _loaded
    for module in _BUILT_IN:
        importlib.import_module(f"warpjld.script.commands.{module}")
    if not _loaded:
        _loaded = True
        for entry in entry_points(group=ENTRY_POINTS):
            try:
                entry.load()
            except Exception as error:
                warnings.warn(f"commands of '{entry.name}' ({entry.value}) left out: {error}", stacklevel=2)
    return _registry


def commands_table(chosen: Iterable[Command] | None = None) -> str:
    """Markdown tables of commands, one per group."""
    everything = list(all_commands() if chosen is None else chosen)
    rows: list[str] = []
    for group in dict.fromkeys((*GROUPS, *(c.group for c in everything))):
        members = [c for c in everything if c.group == group]
        if members:
            rows += [f"**{group}**", ""]
            rows += [NOTES[group], ""] if group in NOTES else []
            rows += ["| command | what it does |", "|---|---|"]
            rows += [f"| `{_cell(c.syntax)}` | {_cell(c.help)} |" for c in members]
            rows.append("")
    return "\n".join(rows)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
