"""Interactive session in the command language: lines run one by one, with undo, save and autosave."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.names import expanded
from warpjld.files.whole_file import whole_file
from warpjld.script.interpreter import Interpreter
from warpjld.script.moment import Moment, moment_of
from warpjld.script.parser import UnfinishedError, parse, parse_file
from warpjld.script.scene import Scene
from warpjld.script.statements import Node, Statement, Text
from warpjld.skeleton import CHANNELS, DIGITS

__all__ = ["AUTOSAVED", "Session"]

AUTOSAVED = "autosaved.jld"
"""Name of the file that keeps lines which were not saved."""

_OWN = ("RUN", "SAVE", "UNDO", "QUIT", "EXIT")


class Session:
    """Runs typed lines on a scene.

    Besides the commands of the language it has ``RUN`` (make the files), ``SAVE "name.jld"`` (save the lines typed),
    ``UNDO`` (undo the last line) and ``QUIT``.

    Attributes:
        scene: The scene that the lines have built so far.
        unfinished: Whether a MACRO still lacks its END.
    """

    def __init__(
        self,
        folder: Path = Path("out"),
        *,
        device: str = "cpu",
        threads: int | None = None,
        say: Callable[[str], None] = print,
    ) -> None:
        self._device, self._threads = device, threads
        self._folder, self._say = folder, say
        self._script: Path | None = None
        self._kept: list[str] = []
        self._before: list[Moment] = []
        self._pending: list[str] = []
        self._saved: list[str] = []
        self._autosaved: Path | None = None
        self._typed = 0
        self._start()

    @property
    def unfinished(self) -> bool:
        """Whether a MACRO still lacks its END."""
        return bool(self._pending)

    def names(self) -> list[str]:
        """Words for completion at the prompt."""
        keywords = {
            "LEFT",
            "RIGHT",
            "KNUCKLES2",
            "KNUCKLES3",
            "VALUES",
            "WIREFRAME",
            "SHADED",
            "BUILTIN",
            "MACRO",
            "END",
        }
        keywords |= {word.upper() for word in (*DIGITS, *CHANNELS)}
        commands = {command.name for command in self._interpreter.registry}
        joints = {name for actor in self.scene.actors.values() for name in actor.skeleton.names}
        return sorted(keywords | commands | set(_OWN) | set(self._interpreter.macros) | set(self.scene.actors) | joints)

    def run_file(self, path: Path) -> None:
        """Run a script before the first typed line."""
        parse_file(path)
        self._script = path
        self._interpreter.run_file(path)

    def type(self, line: str) -> bool:
        """Run a line; False if it was QUIT or EXIT.

        Raises:
            WarpjldError: The line failed; all its effects were undone.
        """
        text = "\n".join([*self._pending, line])
        before = self._typed - len(self._pending)
        self._typed += 1
        try:
            nodes = parse("\n" * before + text, "<shell>")  # so that errors count lines from the first one
        except UnfinishedError:
            self._pending.append(line)
            return True
        except InputError:
            self._pending = []
            raise
        self._pending = []
        if len(nodes) == 1 and isinstance(nodes[0], Statement) and nodes[0].name.text.upper() in _OWN:
            return self._own(nodes[0])
        if nodes and _only_looks(nodes):
            self._interpreter.execute(nodes, None)
        elif nodes:
            moment = moment_of(self._interpreter)
            try:
                self._interpreter.execute(nodes, None)
            except BaseException:  # undo the partial effects of the line
                self._back_to(moment)
                raise
            self._before.append(moment)
            self._kept.append(text)
        return True

    def autosave(self) -> Path | None:
        """Write the lines that were not saved to a new file in the output folder.

        Returns:
            Its path; None if there is nothing to save or the file cannot be written.
        """
        if self._kept == self._saved:
            self._forget()
            return None
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if self._autosaved is None:
                self._autosaved = next(path for path in _places(self._folder) if not path.exists())
            self._write(self._autosaved)
        except OSError:
            return None
        return self._autosaved

    def _forget(self) -> None:
        """Remove the autosaved file, when its lines are saved or undone."""
        if self._autosaved is not None:
            with suppress(OSError):
                self._autosaved.unlink(missing_ok=True)
            self._autosaved = None

    def end(self) -> None:
        """End of the input.

        Raises:
            InputError: A MACRO lacks its END.
        """
        if self._pending:
            raise InputError("this MACRO has no END", path="<shell>", line=self._typed)

    def _start(self) -> None:
        self.scene = Scene(folder=self._folder, say=self._say, device=self._device)
        self._interpreter = Interpreter(self.scene)

    def _own(self, statement: Statement) -> bool:
        name, arguments = statement.name.text.upper(), statement.arguments
        wanted = 1 if name == "SAVE" else 0
        if len(arguments) != wanted or (wanted and not isinstance(arguments[0], Text)):
            raise statement.end.error('expected SAVE "<script>"' if wanted else f"{name} takes no arguments")
        match name:
            case "RUN":
                self._run()
            case "SAVE":
                assert isinstance(arguments[0], Text)
                self._save(arguments[0])
            case "UNDO":
                self._undo(statement)
        return name not in ("QUIT", "EXIT")

    def _run(self) -> None:
        from warpjld.script.runner import run_scene
        from warpjld.script.summary import table

        content = run_scene(self.scene, self._folder, script=self._script, device=self._device, threads=self._threads)
        table(content, self._say)

    def _save(self, name: Text) -> None:
        path = expanded(name.text)
        try:
            self._write(path)
        except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
            reason = error.strerror if isinstance(error, OSError) else error
            raise name.position.error(f"cannot write '{path}': {reason}") from error
        self._saved = list(self._kept)
        self._say(str(path))

    def _write(self, path: Path) -> None:
        lines = [] if self._script is None else [f'INCLUDE "{self._script.resolve().as_posix()}"']
        with whole_file(path) as part:
            part.write_text("\n".join([*lines, *self._kept]) + "\n", encoding="utf-8", errors="backslashreplace")

    def _undo(self, statement: Statement) -> None:
        if not self._kept:
            raise statement.name.position.error("nothing to undo")
        gone = self._kept.pop()
        self._back_to(self._before.pop())
        self._say(f"undone: {gone}")

    def _back_to(self, moment: Moment) -> None:
        self._interpreter = moment.resume()
        self.scene = moment.scene


def _places(folder: Path) -> Iterator[Path]:
    yield folder / AUTOSAVED
    for number in count(2):
        yield folder / f"{Path(AUTOSAVED).stem}-{number}.jld"


def _only_looks(nodes: tuple[Node, ...]) -> bool:
    """Whether statements only print, so that there is nothing to undo."""
    looking = ("SHOW", "HELP", "PRINT")
    return all(isinstance(node, Statement) and node.name.text.upper() in looking for node in nodes)
