"""Incremental execution of a script: after an edit only statements from the first changed one on are run again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import WarpjldError
from warpjld.script.interpreter import Interpreter
from warpjld.script.moment import Moment, moment_of
from warpjld.script.parser import parse
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition, Node, Word

__all__ = ["Performance"]

_APART = 16  # largest number of quick statements between snapshots of the scene
_LONG = 0.02  # duration of a statement after which a snapshot is taken [s]
_REMEMBERED = 8  # results of grasp searches that are cached although the script lacks them, e.g. after UNDO


@dataclass(frozen=True, eq=False)
class _Kept:
    """Snapshot of the scene before the statement with this number."""

    number: int
    moment: Moment


@dataclass(frozen=True, eq=False)
class _Known:
    """Snapshot of the scene after the first statements of a script, with modification times of the files read."""

    nodes: tuple[Node, ...]
    moment: Moment
    files: dict[Path, int | None]

    def holds(self, nodes: tuple[Node, ...]) -> bool:
        """Whether statements begin with those of the snapshot, and the files read are unchanged."""
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
        """Scene after the statements that have run."""
        return self._interpreter.scene

    @property
    def macros(self) -> dict[str, MacroDefinition]:
        """Macros that they define, by name in capitals."""
        return self._interpreter.macros

    def run(
        self,
        text: str,
        path: Path,
        progress: Callable[[str, int, int], None] = lambda what, done, total: None,
        *,
        searching: bool = True,
    ) -> None:
        """Bring the scene to the state after this script; statements that ran already are not run again.

        Args:
            text: Text of the script.
            path: File of the script; it need not exist yet.
            progress: Called before each statement with its command, the count of statements done, and their total.
            searching: Whether grasps are searched for; if not, ``scene`` is the state before the first search.

        Raises:
            InputError: A statement fails; names line and column. ``scene`` is then the state before this statement.
        """
        if path != self._path:
            self._path, self._parsed, self._text, self._done = path, (), "", ()
            self._interpreter, self._kept = self._begun()
        nodes = self._nodes(text)
        self._go_back(_alike(self._done, nodes))
        self._go_on_from_known(nodes)
        begin = len(self._done)
        for number in range(begin, len(nodes)):
            if not searching and _searches(nodes[number], self._interpreter.macros):
                return
            progress(nodes[number].name.text, number - begin, len(nodes) - begin)
            if number - self._kept[-1].number >= _APART:
                self._keep(number)
            began = time.perf_counter()
            try:
                self._interpreter.execute((nodes[number],), path)
            except BaseException:
                self._go_back(number, spoilt=True)  # undo its partial effects
                raise
            self._done = nodes[: number + 1]
            spent = time.perf_counter() - began
            if spent > _LONG:
                self._keep(number + 1)
            if _searches(nodes[number], self._interpreter.macros):
                self._learn(self._done, self._kept[-1].moment)

    def read_by(self, text: str, path: Path) -> list[Path]:
        """Files that a script reads, found by running what needs no search; statements that fail are skipped.

        Raises:
            InputError: The text cannot be parsed.
        """
        for node in parse(text, str(path)):
            if not _searches(node, self._interpreter.macros):
                with suppress(WarpjldError):
                    self._interpreter.execute((node,), path)
        return [*self.scene.read]

    def searches(self, text: str, path: Path) -> bool:
        """Whether running this text would search for grasps, which takes long and should run in a copy (``beside``).

        Raises:
            InputError: The text cannot be parsed.
        """
        nodes = self._nodes(text) if path == self._path else parse(text, str(path))
        known = max((len(one.nodes) for one in self._known if one.holds(nodes)), default=0)
        alike = _alike(self._done, nodes) if path == self._path else 0
        macros = {node.name.text.upper(): node for node in nodes if isinstance(node, MacroDefinition)}
        return any(_searches(node, macros) for node in nodes[max(alike, known) :])

    def beside(self) -> Performance:
        """Independent copy that may run in another thread; ``learn`` takes over its results."""
        other = Performance(self._folder, say=self._say, within=self._within)
        other._path, other._text, other._parsed, other._done = self._path, self._text, self._parsed, self._done
        other._kept, other._known = list(self._kept), deque(self._known, maxlen=_REMEMBERED)
        other._interpreter = moment_of(self._interpreter).resume()
        return other

    def learn(self, other: Performance) -> None:
        """Cache the state that another performance reached, so that its statements need not run here."""
        if other._done:
            self._learn(other._done, moment_of(other._interpreter))

    def copied(self) -> Scene:
        """Independent copy of the current scene."""
        return moment_of(self._interpreter).scene

    def _nodes(self, text: str) -> tuple[Node, ...]:
        """Statements of a text; only those from the first line that differs from the previous text on are parsed."""
        old, new = self._text.split("\n"), text.split("\n")
        same = next((k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
        # the last statement that begins before this line may extend into it
        whole = max((k for k, node in enumerate(self._parsed) if node.name.position.line <= same), default=0)
        start = self._parsed[whole].name.position.line - 1 if whole else 0
        rest = parse("\n" * start + "\n".join(new[start:]), str(self._path))
        self._text, self._parsed = text, (*self._parsed[:whole], *rest)
        return self._parsed

    def _go_back(self, number: int, spoilt: bool = False) -> None:
        """Restore the scene before the statement with this number; ``spoilt``: even if that is the current state."""
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
        self._keep(number)  # an edit is often followed by another at the same place, as while a slider is dragged

    def _go_on_from_known(self, nodes: tuple[Node, ...]) -> None:
        """Continue from the cached snapshot that covers the most statements, if it covers more than are done."""
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
        """Interpreter of an empty scene, and the snapshot of this scene."""
        scene = Scene(folder=self._folder, say=self._tell, warn=self._tell, within=self._within)
        interpreter = Interpreter(scene)
        return interpreter, [_Kept(0, moment_of(interpreter))]

    def _tell(self, line: str) -> None:
        if not self._quiet:  # repeated statements have written their messages before
            self._say(line)


def _changed(path: Path) -> int | None:
    """Time at which a file was last modified [ns]; None if it does not exist."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _alike(old: Sequence[Node], new: Sequence[Node]) -> int:
    """Count of equal statements at the beginning of both scripts."""
    pairs = zip(old, new, strict=False)
    return next((k for k, (a, b) in enumerate(pairs) if a != b), min(len(old), len(new)))


def _searches(node: Node, macros: Mapping[str, MacroDefinition], depth: int = 0) -> bool:
    """Whether a statement, or one in the macro that it calls, is ``GRASP … AUTO``."""
    if isinstance(node, MacroDefinition) or depth > len(macros):
        return False
    name = node.name.text.upper()
    if name in macros:
        return any(_searches(one, macros, depth + 1) for one in macros[name].body)
    return name == "GRASP" and any(isinstance(one, Word) and one.text.upper() == "AUTO" for one in node.arguments)
