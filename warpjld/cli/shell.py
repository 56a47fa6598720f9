"""``warpjld shell``: commands typed one by one, with what they did to look at (R4, R5, R88)."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import click

from warpjld.cli import options
from warpjld.cli.warn import one_line
from warpjld.errors import WarpjldError

__all__ = ["command"]

_PROMPT, _MORE = "jld> ", "...> "
_HISTORY = Path("~/.warpjld_history")
_WELCOME = "HELP lists the commands, RUN makes the files, SAVE keeps what was typed, QUIT leaves."


@click.command("shell")
@click.argument("script", required=False, type=click.Path(path_type=Path))
@options.out_folder
@options.device
@options.threads
@options.commands
def command(script: Path | None, out: Path, device: str, threads: int | None, commands: tuple[Path, ...]) -> None:
    """Type commands of the language, after running SCRIPT if one is given. Commands may also be piped in; then the
    first error ends the shell."""
    from warpjld.runtime.quiet import silence_warp
    from warpjld.script.plugin import load_commands
    from warpjld.script.session import Session

    silence_warp()
    at_terminal = sys.stdin is not None and sys.stdin.isatty()
    for path in commands:
        load_commands(path)
    session = Session(out, device=device, threads=threads, say=click.echo)
    if script is not None:
        session.run_file(script)
    if at_terminal:
        click.echo(_WELCOME)
    for line in _lines(session.names, lambda: _MORE if session.unfinished else _PROMPT, at_terminal):
        try:
            if not session.type(line):
                return
        except WarpjldError as error:
            if not at_terminal:
                raise
            click.echo(f"error: {one_line(str(error))}", err=True)
        except KeyboardInterrupt:
            if not at_terminal:
                raise
            click.echo("stopped; what was typed before is as it was", err=True)
        except Exception as error:  # a fault of the program's own is no reason to lose an afternoon's lines
            kept = session.autosave()
            where = "" if kept is None else f"; the lines before it are in {kept}"
            if not at_terminal:
                raise WarpjldError(f"unexpected {type(error).__name__}: {error}{where}") from error
            click.echo(f"error: unexpected {one_line(f'{type(error).__name__}: {error}')}{where}", err=True)
    session.end()


def _lines(names: Callable[[], list[str]], prompt: Callable[[], str], at_terminal: bool) -> Iterator[str]:
    """Lines from the terminal with history and completion, or plainly from a pipe."""
    if not at_terminal:
        if isinstance(sys.stdin, io.TextIOWrapper):
            sys.stdin.reconfigure(errors="replace")
        yield from (line.rstrip("\r\n") for line in sys.stdin or ())
        return
    read = _reader(names)
    while True:
        try:
            yield read(prompt())
        except KeyboardInterrupt:
            continue
        except EOFError:
            return


def _reader(names: Callable[[], list[str]]) -> Callable[[str], str]:
    try:
        from prompt_toolkit import PromptSession
        from prompt_toolkit.completion import WordCompleter
        from prompt_toolkit.history import FileHistory
    except ImportError:
        click.echo("for history and completion: pip install 'warpjld[shell]'", err=True)
        return input
    completer = WordCompleter(names, ignore_case=True)
    session: PromptSession[str] = PromptSession(
        history=FileHistory(str(_HISTORY.expanduser())), completer=completer, complete_while_typing=False
    )
    return session.prompt
