"""Parser of scripts: text to statements with positions, by ``grammar.lark``."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from warpjld.errors import InputError
from warpjld.limits import check_limit, limit
from warpjld.script.statements import (
    Argument,
    Expression,
    MacroDefinition,
    Node,
    Number,
    Operation,
    Position,
    Reference,
    Statement,
    Text,
    Word,
)

if TYPE_CHECKING:
    from lark import Lark
    from lark.exceptions import UnexpectedInput
from warpjld.files.text_file import read_text

__all__ = ["UnfinishedError", "parse", "parse_file"]

_EXPECTED = {
    "NUMBER": "a number",
    "REFERENCE": "$name",
    "LPAR": "'('",
    "PLUS": "'+'",
    "MINUS": "'-'",
    "TIMES": "'*'",
    "OVER": "'/'",
    "RPAR": "')'",
    "_NEWLINE": "the end of the line",
}


class UnfinishedError(InputError):
    """The text ends inside a MACRO; at a prompt, further lines are read."""


def parse_file(path: str | Path) -> tuple[Node, ...]:
    """Statements of a script file (UTF-8).

    Raises:
        InputError: Unreadable, or not in the language: names line, column and what was expected.
    """
    return parse(read_text(path), str(path))


def parse(text: str, path: str = "<script>") -> tuple[Node, ...]:
    """Statements of a text; ``path`` stands for it in errors. Raises as ``parse_file``."""
    from lark.exceptions import UnexpectedInput

    try:
        tree = _lark().parse(text + "\n")
        return tuple(_Builder(path).node(child) for child in tree.children)
    except UnexpectedInput as error:
        raise _explained(error, text, path) from error
    except RecursionError:
        raise InputError("arithmetic nested too deeply", path=path) from None


@cache
def _lark() -> Lark:
    from lark import Lark

    grammar = files("warpjld.script").joinpath("grammar.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", lexer="contextual", propagate_positions=True)


class _Builder:
    """Converts lark's parse tree to statements."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._depth = 0
        self._deepest = limit("depth")

    def node(self, tree: Any) -> Node:
        if tree.data == "statement":
            return self._statement(tree)
        words = [self._word(token) for token in tree.children if not _is_tree(token)]
        body = tuple(self._statement(child) for child in tree.children if _is_tree(child))
        return MacroDefinition(words[0], tuple(words[1:]), body)

    def _statement(self, tree: Any) -> Statement:
        name, *arguments = tree.children
        end = Position(self.path, tree.meta.end_line, tree.meta.end_column)
        return Statement(self._word(name), tuple(self._argument(a) for a in arguments), end)

    def _argument(self, tree: Any) -> Argument:
        position = Position(self.path, tree.meta.line, tree.meta.column)
        first = tree.children[0]
        match tree.data:
            case "number":
                return Number(float(first), position)
            case "word":
                return Word(str(first), position)
            case "text":
                return Text(str(first)[1:-1], position)
            case "reference":
                return Reference(str(first)[1:].upper(), position)
            case "negative":
                return Operation("-", Number(0.0, position), self._operand(tree.children[1]), position)
        left, operator, right = tree.children
        return Operation(str(operator), self._operand(left), self._operand(right), position)

    def _operand(self, tree: Any) -> Expression:
        self._depth += 1
        if self._depth > self._deepest:
            check_limit("depth", self._depth, of="arithmetic", path=f"{self.path}:{tree.meta.line}:{tree.meta.column}")
        found = cast("Expression", self._argument(tree))
        self._depth -= 1
        return found

    def _word(self, token: Any) -> Word:
        return Word(str(token), Position(self.path, token.line, token.column))


def _is_tree(child: Any) -> bool:
    return hasattr(child, "data")


def _explained(error: UnexpectedInput, text: str, path: str) -> InputError:
    """Convert a syntax error of lark to an InputError with what was found, what was expected, and where."""
    from lark.exceptions import UnexpectedCharacters, UnexpectedToken

    line, column = error.line, error.column
    expected: set[str] = set()
    found = "the end of the script"
    if isinstance(error, UnexpectedCharacters):
        expected = set(error.allowed or ())
        found = _found(text.splitlines()[line - 1][column - 1 :])
    elif isinstance(error, UnexpectedToken):
        expected = set(error.accepts or error.expected)
        if error.token.type == "$END":
            rows = text.splitlines() or [""]
            line, column = len(rows), len(rows[-1]) + 1
        elif error.token.type == "_NEWLINE":
            found = "the end of the line"
        else:
            found = f"'{error.token}'"
    if "_END" in expected and found == "the end of the script":
        return UnfinishedError("this MACRO has no END", path=path, line=line, column=column)
    if found[1:2] in tuple("\"'"):
        message = "this text has no closing quote"
    elif expected & {"WORD"} and not expected & {"NUMBER"}:
        message = f"expected a command or a name, found {found}"
    elif "TEXT" in expected:
        message = f"expected a word, a number or a quoted text, found {found}"
    else:
        names = [_EXPECTED[name] for name in _EXPECTED if name in expected]
        message = f"expected {', '.join(names)}, found {found}"
    return InputError(message, path=path, line=line, column=column)


def _found(rest: str) -> str:
    words = rest.split(maxsplit=1)
    return f"'{words[0]}'" if words else "the end of the line"
