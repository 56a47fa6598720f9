"""Interpreter of scripts: runs statements, macros, include files, and commands from the registry."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import InputError, WarpjldError
from warpjld.files.names import expanded
from warpjld.limits import check_limit, limit
from warpjld.script.arguments import Arguments
from warpjld.script.parser import parse, parse_file
from warpjld.script.registry import RESERVED, Command, Registry, all_commands
from warpjld.script.statements import (
    Argument,
    MacroDefinition,
    Node,
    Number,
    Operation,
    Position,
    Reference,
    Statement,
    Text,
    Value,
    Word,
)
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.script.scene import Scene

__all__ = ["Interpreter"]

_DEEPEST = 50  # nesting of macro calls
_IN_TEXT = re.compile(r"\$(?:([^\W\d]\w*)|\{([^\W\d]\w*)\})")


class Interpreter:
    """Runs scripts on one scene; macros stay defined from one script to the next.

    Attributes:
        scene: The scene that the commands change.
        macros: Macros defined so far, by name in capitals.
    """

    def __init__(self, scene: Scene, registry: Registry | None = None) -> None:
        self.scene = scene
        self.macros: dict[str, MacroDefinition] = {}
        self._registry = all_commands() if registry is None else registry
        self._including: list[Path] = []
        self._depth = 0
        self._made = 0
        self._parsed: dict[Path, tuple[Node, ...]] = {}

    @property
    def registry(self) -> Registry:
        """Registry of the commands."""
        return self._registry

    def run_file(self, path: str | Path) -> None:
        """Run a script file.

        All command names in it, and in the files it includes, are checked before the first command runs.

        Raises:
            InputError: With file, line and column.
        """
        self.execute(self._read(Path(path)), Path(path))

    def run_text(self, text: str, path: str = "<script>") -> None:
        """Run a text; ``path`` stands for it in errors. File names in it are relative to the current folder."""
        self.execute(parse(text, path), None)

    def execute(self, nodes: Sequence[Node], path: Path | None) -> None:
        """Run statements that were read from ``path``."""
        with self._inside(path):
            if self._depth == 0 and len(self._including) <= 1:
                self._made = 0
                if path is None:
                    self._parsed.clear()  # files may have been edited since the line before
                self._check(nodes, set(self.macros) | self._macro_names(nodes, set()), set())
            for node in nodes:
                if isinstance(node, MacroDefinition):
                    self._define(node)
                else:
                    self._call(node, {})

    def include(self, path: Path, position: Position) -> None:
        """Run an include file; ``position`` is that of its INCLUDE."""
        self._refuse_cycle(path, position)
        self.execute(self._read(path), path)

    def _read(self, path: Path) -> tuple[Node, ...]:
        """Statements of a file; parsed once and cached."""
        key = path.resolve()
        if key not in self._parsed:
            self._parsed[key] = parse_file(path)
        return self._parsed[key]

    # ---- before anything runs ------------------------------------------------------------------------------------

    def _macro_names(self, nodes: Sequence[Node], seen: set[Path]) -> set[str]:
        """Names of the macros that these statements and the files they include define."""
        names = {node.name.text.upper() for node in nodes if isinstance(node, MacroDefinition)}
        for path, position in self._includes(nodes):
            self._refuse_cycle(path, position)
            if path.resolve() in seen:
                continue
            with self._inside(path):
                names |= self._macro_names(self._read(path), seen)
            seen.add(path.resolve())
        return names

    def _check(self, nodes: Sequence[Node], macros: set[str], seen: set[Path]) -> None:
        """Check that every command named in these statements, macros and include files exists."""
        for node in nodes:
            for statement in node.body if isinstance(node, MacroDefinition) else (node,):
                self._check_name(statement.name, macros)
        for path, _ in self._includes(nodes):
            if path.resolve() in seen:
                continue
            seen.add(path.resolve())
            with self._inside(path):
                self._check(self._read(path), macros, seen)

    def _includes(self, nodes: Sequence[Node]) -> Iterator[tuple[Path, Position]]:
        return ((path, position) for path, position in _includes(nodes) if self.scene.may_read(path))

    def _check_name(self, word: Word, macros: set[str]) -> None:
        name = word.text.upper()
        if name in self._registry or name in macros:
            return
        if name == "MACRO":
            raise word.position.error("a MACRO cannot be defined inside another")
        if name == "END":
            raise word.position.error("END without a MACRO")
        known = [command.name for command in self._registry]
        raise word.position.error(f"there is no command {word}{did_you_mean(name, [*known, *macros, 'MACRO', 'END'])}")

    # ---- running -------------------------------------------------------------------------------------------------

    def _define(self, macro: MacroDefinition) -> None:
        name = macro.name.text.upper()
        if name in self._registry or name in RESERVED:
            raise macro.name.position.error(f"{name} is a word of the language; choose another name for the macro")
        parameters = [word.text.upper() for word in macro.parameters]
        for k, word in enumerate(macro.parameters):
            if parameters[k] in parameters[:k]:
                raise word.position.error(f"two parameters are called {word}")
        for statement in macro.body:
            for argument in statement.arguments:
                for reference in _references(argument):
                    if reference.name not in parameters:
                        hint = did_you_mean(reference.name, parameters)
                        raise reference.position.error(f"${reference.name} is not a parameter of {name}{hint}")
        self.macros[name] = macro

    def _call(self, statement: Statement, bound: Mapping[str, Value]) -> None:
        self._made += 1
        if self._made > limit("statements"):  # macros that call macros: ten lines of ten make 10¹⁰
            with _at(statement.name.position):
                check_limit("statements", self._made)
        values = [_evaluate(argument, bound) for argument in statement.arguments]
        name = statement.name.text.upper()
        if name in self.macros:
            self._call_macro(statement, self.macros[name], values)
            return
        self._check_name(statement.name, set(self.macros))
        command = self._registry[name]
        arguments = Arguments(command, values, statement.name.position, statement.end, self)
        with _placed(command, statement.name.position):
            command.run(self.scene, arguments)
            arguments.finish()

    def _call_macro(self, statement: Statement, macro: MacroDefinition, values: list[Value]) -> None:
        name, wanted, here = macro.name.text.upper(), macro.parameters, statement.name.position
        if len(values) != len(wanted):
            position = values[len(wanted)].position if len(values) > len(wanted) else statement.end
            syntax = " ".join([name, *(f"<{word}>" for word in wanted)])
            raise position.error(f"macro {name} needs {len(wanted)} arguments, got {len(values)}; it is {syntax}")
        if self._depth >= _DEEPEST:
            raise here.error(f"macros call one another more than {_DEEPEST} deep: {name} never ends")
        bound = {word.text.upper(): value for word, value in zip(wanted, values, strict=True)}
        self._depth += 1
        try:
            for inner in macro.body:
                self._call(inner, bound)
        except InputError as error:
            if self._depth > 1:
                raise
            called = f" (in {name}, called at {here.path}:{here.line})"
            raise InputError(error.message + called, path=error.path, line=error.line, column=error.column) from error
        finally:
            self._depth -= 1

    # ---- include files -------------------------------------------------------------------------------------------

    @contextmanager
    def _inside(self, path: Path | None) -> Iterator[None]:
        """Context in which ``path`` is being run; including it again inside is a cycle."""
        if path is None:
            yield
            return
        self._including.append(path.resolve())
        try:
            yield
        finally:
            self._including.pop()

    def _refuse_cycle(self, path: Path, position: Position) -> None:
        if path.resolve() in self._including:
            chain = " → ".join(p.name for p in [*self._including, path])
            raise position.error(f"files include one another in a circle: {chain}")


@contextmanager
def _placed(command: Command, position: Position) -> Iterator[None]:
    """Give errors without a position in a script that of the command; report exceptions of user commands as errors."""
    try:
        yield
    except InputError as error:
        # a line generated by a user's command does not exist in any file: report the command's position instead
        made_up = str(error.path).startswith("<") and str(error.path) != position.path
        if error.line is not None and error.column is not None and not made_up:
            raise
        raise position.error(str(error)) from error
    except WarpjldError:
        raise
    except Exception as error:
        if command.run.__module__.startswith("warpjld."):
            raise
        raise position.error(f"{command.name} failed: {type(error).__name__}: {error}") from error


@contextmanager
def _at(position: Position) -> Iterator[None]:
    """Give errors raised inside this position."""
    try:
        yield
    except InputError as error:
        raise position.error(error.message) from error


def _includes(nodes: Sequence[Node]) -> Iterator[tuple[Path, Position]]:
    """Include files with a literal name that exist, with their positions; others are reported when they are run."""
    for node in nodes:
        if isinstance(node, Statement) and node.name.text.upper() == "INCLUDE" and node.arguments:
            name = node.arguments[0]
            if isinstance(name, Text):
                folder = Path() if name.position.path.startswith("<") else Path(name.position.path).parent
                path = folder / expanded(name.text)
                if path.is_file():
                    yield path, name.position


def _references(argument: Argument) -> Iterator[Reference]:
    if isinstance(argument, Reference):
        yield argument
    elif isinstance(argument, Operation):
        yield from _references(argument.left)
        yield from _references(argument.right)
    elif isinstance(argument, Text):
        for match in _IN_TEXT.finditer(argument.text):
            yield Reference((match[1] or match[2]).upper(), argument.position)


def _evaluate(argument: Argument, bound: Mapping[str, Value]) -> Value:
    """Value of an argument: macro parameters substituted, arithmetic evaluated."""
    if isinstance(argument, Reference):
        if argument.name not in bound:
            raise argument.position.error(f"${argument.name} is only defined inside a macro that has this parameter")
        return bound[argument.name]
    if isinstance(argument, Text) and bound:
        text = _IN_TEXT.sub(lambda m: _plain(bound[(m[1] or m[2]).upper()]), argument.text)
        with _at(argument.position):
            check_limit("text", len(text))
        return Text(text, argument.position)
    if not isinstance(argument, Operation):
        return argument
    left, right = (_evaluate(side, bound) for side in (argument.left, argument.right))
    for side in (left, right):
        if not isinstance(side, Number):
            raise argument.position.error(f"arithmetic needs numbers, got {side}")
    assert isinstance(left, Number)
    assert isinstance(right, Number)
    a, b = left.value, right.value
    if argument.operator == "/" and b == 0.0:
        raise argument.position.error("division by zero")
    result = {"+": a + b, "-": a - b, "*": a * b}.get(argument.operator)
    return Number(a / b if result is None else result, argument.position)


def _plain(value: Value) -> str:
    return f"{value.value:g}" if isinstance(value, Number) else value.text
