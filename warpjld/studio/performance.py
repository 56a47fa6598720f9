"""Incremental execution of a script: after an edit only statements from the first changed one on are run again."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from warpjld.script.interpreter import Interpreter
from warpjld.script.moment import Moment, moment_of
from warpjld.script.parser import parse
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition, Node

__all__ = ["Performance"]

_APART = 16  # statements that are run again at most, of those that take no time
_LONG = 0.02  # seconds after which what a statement did is kept


@dataclass(frozen=True, eq=False)
class _Kept:
    """The scene before the statement of that number."""

    number: int
    moment: Moment


class Performance:
    """Runs the statements of a document on a scene.

    Args:
        folder: The output folder of its scenes.
        say: Where PRINT and SHOW write, and warnings.
        within: Folders that files may be read from; None for anywhere.
    """

    def __init__(
        self, folder: Path, *, say: Callable[[str], None] = print, within: Sequence[Path] | None = None
    ) -> None:
        self._folder, self._say = folder, say
        self._within = None if within is None else tuple(path.resolve() for path in within)
        self._path: Path | None = None
        self._text = ""
        self._parsed: tuple[Node, ...] = ()
        self._done: tuple[Node, ...] = ()
        self._quiet = False
        self._interpreter, self._kept = self._begun()

    @property
    def scene(self) -> Scene:
        """What the statements that ran describe."""
        return self._interpreter.scene

    @property
    def macros(self) -> dict[str, MacroDefinition]:
        """Macros that they define, by name in capitals."""
        return self._interpreter.macros

    def run(self, text: str, path: Path) -> None:
        """Make the scene that of this text, which stands in this file or will.

        Raises:
            InputError: With line and column; ``scene`` is then that of the statements before.
        """
        if path != self._path:
            self._path, self._parsed, self._text, self._done = path, (), "", ()
            self._interpreter, self._kept = self._begun()
        nodes = self._nodes(text)
        self._go_back(_alike(self._done, nodes))
        for number in range(len(self._done), len(nodes)):
            if number - self._kept[-1].number >= _APART:
                self._keep(number)
            began = time.perf_counter()
            try:
                self._interpreter.execute((nodes[number],), path)
            except BaseException:
                self._go_back(number, spoilt=True)  # what of it has happened is taken back
                raise
            self._done = nodes[: number + 1]
            if time.perf_counter() - began > _LONG:
                self._keep(number + 1)

    def copied(self) -> Scene:
        """A scene like the one that is there, which nothing of what happens here changes."""
        return moment_of(self._interpreter).scene

    def _nodes(self, text: str) -> tuple[Node, ...]:
        """The statements of a text; those before the first line that differs from the text before stay as they are."""
        old, new = self._text.split("\n"), text.split("\n")
        same = next((k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
        # the last statement that begins before that line may go on in it
        whole = max((k for k, node in enumerate(self._parsed) if node.name.position.line <= same), default=0)
        start = self._parsed[whole].name.position.line - 1 if whole else 0
        rest = parse("\n" * start + "\n".join(new[start:]), str(self._path))
        self._text, self._parsed = text, (*self._parsed[:whole], *rest)
        return self._parsed

    def _go_back(self, number: int, spoilt: bool = False) -> None:
        """Make the scene what it was before the statement of that number."""
        if number == len(self._done) and not spoilt:
            return
        while self._kept[-1].number > number:
            self._kept.pop()
        last = self._kept[-1]
        self._interpreter = last.moment.copy().resume()
        self._quiet = True
        try:
            for node in self._done[last.number : number]:
                self._interpreter.execute((node,), self._path)
        finally:
            self._quiet = False
        self._done = self._done[:number]

    def _keep(self, number: int) -> None:
        if self._kept[-1].number < number:
            self._kept.append(_Kept(number, moment_of(self._interpreter)))

    def _begun(self) -> tuple[Interpreter, list[_Kept]]:
        """An empty scene, and the moment before anything happens to it."""
        scene = Scene(folder=self._folder, say=self._tell, warn=self._tell, within=self._within)
        interpreter = Interpreter(scene)
        return interpreter, [_Kept(0, moment_of(interpreter))]

    def _tell(self, line: str) -> None:
        if not self._quiet:  # what runs again has been said
            self._say(line)


def _alike(old: Sequence[Node], new: Sequence[Node]) -> int:
    """How many statements are as they were."""
    pairs = zip(old, new, strict=False)
    return next((k for k, (a, b) in enumerate(pairs) if a != b), min(len(old), len(new)))
