"""Incremental execution of a script: after an edit only statements from the first changed one on are run again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from warpjld.script.interpreter import Interpreter
from warpjld.script.moment import Moment, moment_of
from warpjld.script.parser import parse
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition, Node, Word

__all__ = ["Performance"]

_APART = 16  # statements that are run again at most, of those that take no time
_LONG = 0.02  # seconds after which what a statement did is kept
_REMEMBERED = 8  # searches whose outcomes are remembered while the script does not have them, as after UNDO


@dataclass(frozen=True, eq=False)
class _Kept:
    """The scene before the statement of that number."""

    number: int
    moment: Moment


@dataclass(frozen=True, eq=False)
class _Known:
    """The scene after some statements from the top, and the files that they read as they were."""

    nodes: tuple[Node, ...]
    moment: Moment
    files: dict[Path, int | None]

    def holds(self, nodes: tuple[Node, ...]) -> bool:
        """Whether these statements begin so, and would read the same files."""
        same = self.nodes == nodes[: len(self.nodes)]
        return same and all(_changed(path) == time for path, time in self.files.items())


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
        self._known: deque[_Known] = deque(maxlen=_REMEMBERED)
        self._interpreter, self._kept = self._begun()

    @property
    def scene(self) -> Scene:
        """What the statements that ran describe."""
        return self._interpreter.scene

    @property
    def macros(self) -> dict[str, MacroDefinition]:
        """Macros that they define, by name in capitals."""
        return self._interpreter.macros

    def run(
        self, text: str, path: Path, progress: Callable[[str, int, int], None] = lambda what, done, total: None
    ) -> None:
        """Make the scene that of this text, which stands in this file or will.

        Args:
            text: The script.
            path: Its file.
            progress: Told, before each statement that runs, its command and how many are done of how many.

        Raises:
            InputError: With line and column; ``scene`` is then that of the statements before.
        """
        if path != self._path:
            self._path, self._parsed, self._text, self._done = path, (), "", ()
            self._interpreter, self._kept = self._begun()
        nodes = self._nodes(text)
        self._go_back(_alike(self._done, nodes))
        self._go_on_from_known(nodes)
        begin = len(self._done)
        for number in range(begin, len(nodes)):
            progress(nodes[number].name.text, number - begin, len(nodes) - begin)
            if number - self._kept[-1].number >= _APART:
                self._keep(number)
            began = time.perf_counter()
            try:
                self._interpreter.execute((nodes[number],), path)
            except BaseException:
                self._go_back(number, spoilt=True)  # what of it has happened is taken back
                raise
            self._done = nodes[: number + 1]
            spent = time.perf_counter() - began
            if spent > _LONG:
                self._keep(number + 1)
            if _searches(nodes[number], self._interpreter.macros):
                self._learn(self._done, self._kept[-1].moment)

    def searches(self, text: str, path: Path) -> bool:
        """Whether running this text would search for grasps: that takes long, and is better done by a ``beside``.

        Raises:
            InputError: It cannot be parsed.
        """
        nodes = self._nodes(text) if path == self._path else parse(text, str(path))
        known = max((len(one.nodes) for one in self._known if one.holds(nodes)), default=0)
        alike = _alike(self._done, nodes) if path == self._path else 0
        macros = {node.name.text.upper(): node for node in nodes if isinstance(node, MacroDefinition)}
        return any(_searches(node, macros) for node in nodes[max(alike, known) :])

    def beside(self) -> Performance:
        """Another of the same text, which may run in another thread; ``learn`` takes over what it found."""
        other = Performance(self._folder, say=self._say, within=self._within)
        other._path, other._text, other._parsed, other._done = self._path, self._text, self._parsed, self._done
        other._kept, other._known = list(self._kept), deque(self._known, maxlen=_REMEMBERED)
        other._interpreter = moment_of(self._interpreter).resume()
        return other

    def learn(self, other: Performance) -> None:
        """Know what statements came to that another ran: they need not run here."""
        if other._done:
            self._learn(other._done, moment_of(other._interpreter))

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

    def _go_on_from_known(self, nodes: tuple[Node, ...]) -> None:
        """Make the scene what it is after the most statements that ran once already."""
        for one in sorted(self._known, key=lambda one: -len(one.nodes)):
            if len(one.nodes) > len(self._done) and one.holds(nodes):
                self._interpreter, self._done = one.moment.copy().resume(), one.nodes
                self._kept.append(_Kept(len(one.nodes), one.moment))
                return

    def _learn(self, nodes: tuple[Node, ...], moment: Moment) -> None:
        self._known.append(_Known(nodes, moment, {path: _changed(path) for path in moment.scene.read}))

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


def _changed(path: Path) -> int | None:
    """When a file was changed last [ns]; None where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _alike(old: Sequence[Node], new: Sequence[Node]) -> int:
    """How many statements are as they were."""
    pairs = zip(old, new, strict=False)
    return next((k for k, (a, b) in enumerate(pairs) if a != b), min(len(old), len(new)))


def _searches(node: Node, macros: Mapping[str, MacroDefinition], depth: int = 0) -> bool:
    """Whether a statement, or one of the macro that it calls, is a search for a grasp."""
    if isinstance(node, MacroDefinition) or depth > len(macros):
        return False
    name = node.name.text.upper()
    if name in macros:
        return any(_searches(one, macros, depth + 1) for one in macros[name].body)
    return name == "GRASP" and any(isinstance(one, Word) and one.text.upper() == "AUTO" for one in node.arguments)
