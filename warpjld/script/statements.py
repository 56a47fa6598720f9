"""Syntax tree of scripts: statements and arguments with their positions."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.errors import InputError

__all__ = [
    "Argument",
    "Expression",
    "MacroDefinition",
    "Node",
    "Number",
    "Operation",
    "Position",
    "Reference",
    "Statement",
    "Text",
    "Value",
    "Word",
]


@dataclass(frozen=True)
class Position:
    """Position in a script: 1-based line and column; ``path`` is the file, or a name in angle brackets."""

    path: str
    line: int
    column: int

    def error(self, message: str) -> InputError:
        """An error located here, to be raised."""
        return InputError(message, path=self.path, line=self.line, column=self.column)


@dataclass(frozen=True)
class Number:
    """A number, literal or the value of an expression."""

    value: float
    position: Position

    def __str__(self) -> str:
        whole = self.value.is_integer() and abs(self.value) < 1e15
        return f"{self.value:.0f}" if whole else f"{self.value:g}"


@dataclass(frozen=True)
class Word:
    """An unquoted word: a keyword or a name."""

    text: str
    position: Position

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Text:
    """A quoted text: a file name, a message. ``$name`` in it is replaced inside macros."""

    text: str
    position: Position

    def __str__(self) -> str:
        return f'"{self.text}"'


@dataclass(frozen=True)
class Reference:
    """``$name``: a parameter of the enclosing macro."""

    name: str
    position: Position


@dataclass(frozen=True)
class Operation:
    """Binary arithmetic operation; the sign in −x is the operation 0 − x."""

    operator: str
    left: Expression
    right: Expression
    position: Position


Value = Number | Word | Text
Expression = Number | Reference | Operation
Argument = Value | Reference | Operation


@dataclass(frozen=True)
class Statement:
    """A command and its arguments; ``end`` is the position after the last one."""

    name: Word
    arguments: tuple[Argument, ...]
    end: Position


@dataclass(frozen=True)
class MacroDefinition:
    """``MACRO name parameters … END``."""

    name: Word
    parameters: tuple[Word, ...]
    body: tuple[Statement, ...]


Node = Statement | MacroDefinition
