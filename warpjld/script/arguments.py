"""Typed readers for the arguments of a command; errors state what was expected, with line and column."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import InputError
from warpjld.files.names import check_name, expanded
from warpjld.geometry.lengths import LARGEST
from warpjld.script.statements import Number, Position, Text, Value, Word
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.script.interpreter import Interpreter
    from warpjld.script.registry import Command

__all__ = ["Arguments"]

_MOST_KEYS = 10_000  # keys that one command may set
_LARGEST = 1e12  # magnitude of the numbers in a script, unless the argument states a range


class Arguments:
    """The arguments of one call of a command, read from left to right.

    Attributes:
        command: The command called.
        position: Position of the call in the script.
        interpreter: The interpreter that runs it, for commands that run other commands.

    Examples:
        >>> @wj.command("NUDGE", syntax="NUDGE <LEFT/RIGHT> <metres>", help="Say how far.")
        ... def nudge(scene: wj.Scene, arguments: wj.Arguments) -> None:
        ...     side = arguments.choice("the side", ("LEFT", "RIGHT"))
        ...     scene.say(f"{side} by {arguments.number('the way', minimum=0):g} m")
        >>> from warpjld.script import Interpreter, all_commands
        >>> Interpreter(wj.Scene()).run_text("NUDGE LEFT 0.02")
        LEFT by 0.02 m
        >>> all_commands().remove("NUDGE")
    """

    def __init__(
        self,
        command: Command,
        values: Sequence[Value],
        position: Position,
        end: Position,
        interpreter: Interpreter,
    ) -> None:
        self.command = command
        self.position = position
        self.interpreter = interpreter
        self._values = tuple(values)
        self._next = 0
        self._end = end

    def __len__(self) -> int:
        """Number of arguments not read yet."""
        return len(self._values) - self._next

    def __bool__(self) -> bool:
        return len(self) > 0

    @property
    def last(self) -> Position:
        """Position of the argument that was read last; of the command if none was."""
        return self._values[self._next - 1].position if self._next else self.position

    def error(self, message: str, position: Position | None = None) -> InputError:
        """An error to be raised, located at the argument read last or at ``position``."""
        return (position or self.last).error(message)

    def expected(self, what: str, hint: str = "") -> InputError:
        """An error to be raised: the next argument, or its absence, is not ``what``."""
        if not self:
            return self._end.error(f"expected {what} here{hint}; {self._usage}")
        value = self._values[self._next]
        return value.position.error(f"expected {what}, found {value}{hint}; {self._usage}")

    @property
    def _usage(self) -> str:
        return f"the command is {self.command.syntax}"

    def finish(self) -> None:
        """Check that no argument is left over.

        Raises:
            InputError: There is one.
        """
        if self:
            raise self.expected("the end of the line")

    # ---- numbers -------------------------------------------------------------------------------------------------

    def number(
        self,
        what: str,
        *,
        minimum: float = -_LARGEST,
        maximum: float = _LARGEST,
        above: float = -math.inf,
    ) -> float:
        """Read a number in [minimum, maximum] and greater than ``above``; ``what`` names it in errors.

        The default range reaches to 10¹², about the modulus of diamond in pascals, the largest quantity in scripts.
        """
        value = self._peek()
        if not isinstance(value, Number):
            raise self.expected(what)
        self._next += 1
        if not math.isfinite(value.value):
            raise self.error(f"{what} must be a finite number")
        if value.value < minimum:
            raise self.error(f"{what} must be {minimum:g} or more, got {value}")
        if value.value > maximum:
            raise self.error(f"{what} must be {maximum:g} or less, got {value}")
        if value.value <= above:
            raise self.error(f"{what} must be greater than {above:g}, got {value}")
        return value.value

    def integer(self, what: str, *, minimum: int | None = None, maximum: int | None = None) -> int:
        """Read an integer."""
        low, high = (-_LARGEST if minimum is None else minimum), (_LARGEST if maximum is None else maximum)
        value = self.number(what, minimum=low, maximum=high)
        if value != round(value):
            raise self.error(f"{what} must be a whole number, got {value:g}")
        return round(value)

    def vector(self, what: str) -> tuple[float, float, float]:
        """Read three numbers."""
        x, y, z = (self.number(f"{what} {axis}", minimum=-LARGEST, maximum=LARGEST) for axis in "xyz")
        return x, y, z

    def has_number(self) -> bool:
        """Whether the next argument is a number."""
        return isinstance(self._peek(), Number)

    def keys_and_value(self, what: str = "the value in degrees") -> tuple[list[float], float]:
        """Read ``<key1> <key2> <step> <value>`` or ``AT <key> <value>`` (C15).

        Returns:
            Frames of the keys: key1, key1 + step, … up to key2, or the single key; and the value.
        """
        if self.keyword("AT"):
            return [self.number("the key (a frame)")], self.number(what)
        first = self.number("key1 (the first frame)")
        second = self.number("key2 (the last frame)")
        if second < first:
            raise self.error(f"key2 must not come before key1 ({first:g}), got {second:g}")
        step = self.number("the step in frames", above=0.0)
        count = math.floor((second - first) / step + 1e-9) + 1
        if count > _MOST_KEYS:
            raise self.error(f"a step of {step:g} makes {count:,} keys; at most {_MOST_KEYS:,}")
        return [first + k * step for k in range(count)], self.number(what)

    # ---- words ---------------------------------------------------------------------------------------------------

    def keyword(self, *words: str) -> str | None:
        """Read one of these keywords, returned in capitals; None, and nothing is read, if another argument is next."""
        value = self._peek()
        if isinstance(value, Word) and value.text.upper() in words:
            self._next += 1
            return value.text.upper()
        return None

    def choice(self, what: str, options: Iterable[str], beside: Iterable[str] = ()) -> str:
        """Read one of these keywords, returned in capitals; ``beside`` are further words for spelling hints."""
        wanted = list(options)
        word = self.keyword(*wanted)
        if word is None:
            value = self._peek()
            hint = did_you_mean(value.text, [*wanted, *beside]) if isinstance(value, Word) else ""
            raise self.expected(f"{what} ({'/'.join(wanted)})" if what else "/".join(wanted), hint)
        return word

    def choices(self, *groups: Sequence[str]) -> list[str]:
        """Read one keyword of every group, in any order; returned in the groups' order, in capitals."""
        found: dict[int, str] = {}
        while len(found) < len(groups):
            missing = [g for g in range(len(groups)) if g not in found]
            word = self.keyword(*(option for g in missing for option in groups[g]))
            if word is None:
                value = self._peek()
                known = [option for g in missing for option in groups[g]]
                hint = did_you_mean(value.text, known) if isinstance(value, Word) else ""
                raise self.expected("/".join(groups[missing[0]]), hint)
            found[next(g for g in missing if word in groups[g])] = word
        return [found[g] for g in range(len(groups))]

    def options(self, *beside: str, **readers: Callable[[], object]) -> dict[str, object]:
        """Read named options ``NAME value …`` in any order up to the end of the line: name in lower case → value.

        Args:
            beside: Words that are allowed before the options, for spelling hints in errors.
            readers: Function that reads the value of each option, by its name in lower case.
        """
        out: dict[str, object] = {}
        while self:
            name = self.choice("an option", [n.upper() for n in readers], beside).lower()
            if name in out:
                raise self.error(f"{name.upper()} is given twice")
            out[name] = readers[name]()
        return out

    def text(self, what: str) -> str:
        """Read a quoted text."""
        value = self._peek()
        if not isinstance(value, Text):
            raise self.expected(f"{what} in quotes")
        self._next += 1
        return value.text

    def name(self, what: str) -> str:
        """Read a name: a word, or a quoted text (needed where it contains blanks or signs)."""
        value = self._peek()
        if not isinstance(value, Word | Text):
            raise self.expected(what)
        self._next += 1
        return value.text

    def next_word(self) -> str | None:
        """The next word or quoted text, without consuming it; None at the end."""
        value = self._peek()
        return value.text if isinstance(value, Word | Text) else None

    def new_name(self, what: str) -> str:
        """Read the name of something new; as ``name``, but it must also be usable as a file name."""
        name = self.name(what)
        try:
            return check_name(name, what)
        except InputError as error:
            raise self.error(error.message) from None

    def has_text(self) -> bool:
        """Whether the next argument is a quoted text."""
        return isinstance(self._peek(), Text)

    def anything(self) -> Value:
        """Read the next argument, of any kind."""
        value = self._peek()
        if value is None:
            raise self.expected("an argument")
        self._next += 1
        return value

    # ---- files ---------------------------------------------------------------------------------------------------

    def input_file(self, what: str) -> Path:
        """Read a quoted name of an existing file, relative to the script's folder (at a prompt, to the current one)."""
        name = self.text(what)
        if "\0" in name:
            raise self.error(f"{name!r}: no file has a zero byte in its name")
        script = Path(self.last.path)
        folder = Path() if self.last.path.startswith("<") else script.parent
        path = folder / expanded(name)
        if not self.interpreter.scene.may_read(path):
            raise self.error(f"'{name}' is outside the folder of this script, and nothing there may be read from here")
        if not path.is_file():
            if path.is_dir():
                raise self.error(f"'{path}' is a folder; want a file")
            there = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
            raise self.error(f"there is no file '{path}'{did_you_mean(path.name, there)}")
        self.interpreter.scene.read.append(path)
        return path

    def output_name(self, what: str, suffixes: Sequence[str]) -> str:
        """Read a quoted name of a file to be written into the output folder, with one of these suffixes."""
        name = self.text(what)
        path = Path(name)
        if path.is_absolute() or ".." in path.parts or not path.name:
            raise self.error(f"'{name}': want a name inside the output folder (choose the folder with --out)")
        try:
            for part in path.parts:
                check_name(part, "the name")
        except InputError as error:
            raise self.error(error.message) from None
        if path.suffix.lower() not in suffixes:
            hint = did_you_mean(path.suffix, suffixes) if path.suffix else ""
            raise self.error(f"'{name}': want a name that ends in {', '.join(suffixes)}{hint}")
        return path.as_posix()

    def _peek(self) -> Value | None:
        return self._values[self._next] if self else None
