"""``warpjld shell``: interactive session in the command language (R4, R5, R88)."""

from __future__ import annotations

import io
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from warpjld.cli import options
from warpjld.cli.warn import one_line
from warpjld.errors import WarpjldError

if TYPE_CHECKING:
    from warpjld.script.session import Session

__all__ = ["shell_command"]

_PROMPT, _MORE = "jld> ", "...> "
_HISTORY = Path("~/.warpjld_history")
_WELCOME = 'HELP lists the commands, RUN makes the files, SAVE "name.jld" saves the lines, QUIT leaves.'
_ENDS = ("SIGTERM", "SIGHUP")
"""Signals that end a session."""


class _EndedError(BaseException):
    """Raised by the handler of these signals."""


@click.command("shell")
@click.argument("script", required=False, type=click.Path(path_type=Path))
@options.out_folder
@options.device
@options.threads
@options.commands
def shell_command(script: Path | None, out: Path, device: str, threads: int | None, commands: tuple[Path, ...]) -> None:
    """Run the commands of scripts interactively, after SCRIPT if one is given. Commands may also be piped in; then the
    first error ends the shell."""
    from warpjld.runtime.quiet import silence_warp
    from warpjld.script.plugin import load_commands
    from warpjld.script.session import Session

    silence_warp()
    for path in commands:
        load_commands(path)
    session = Session(out, device=device, threads=threads, say=click.echo)
    if sys.stdin is not None and sys.stdin.isatty():
        _converse(session, script)
    else:
        _read_through(session, script)


def _read_through(session: Session, script: Path | None) -> None:
    """Run commands from a pipe; the first error ends the session."""
    if script is not None:
        session.run_file(script)
    if isinstance(sys.stdin, io.TextIOWrapper):
        sys.stdin.reconfigure(errors="replace")
    for line in sys.stdin or ():
        try:
            if not session.type(line.rstrip("\r\n")):
                return
        except WarpjldError:
            raise
        except Exception as error:
            message = f"unexpected {type(error).__name__}: {error}"
            raise WarpjldError(f"{message}{_kept(session)}") from error
    session.end()


def _converse(session: Session, script: Path | None) -> None:
    """Run a session at a terminal until QUIT: errors are printed and do not end it; unsaved lines are autosaved."""
    for name in _ENDS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _end)
    _watch_terminal()
    goes_on = True
    try:
        if script is not None:
            _guarded(session, lambda: session.run_file(script))
        click.echo(_WELCOME)
        lines = _lines(session.names, lambda: _MORE if session.unfinished else _PROMPT, lambda: _kept(session))
        while goes_on and (line := next(lines, None)) is not None:
            goes_on = _guarded(session, lambda line=line: session.type(line))  # type: ignore[misc]
    except _EndedError:
        sys.exit(130)
    finally:
        if kept := _kept(session):
            with suppress(OSError):  # the terminal may be gone
                click.echo(f"not saved{kept}", err=True)


def _guarded(session: Session, act: Callable[[], object]) -> bool:
    """Run ``act``, print any error, and autosave; False only if the line was QUIT."""
    try:
        try:
            goes_on = act() is not False
            session.autosave()
            return goes_on
        except WarpjldError as error:
            click.echo(f"error: {one_line(str(error))}", err=True)
        except KeyboardInterrupt:
            click.echo("stopped; the effects of this line are undone", err=True)
        except (Exception, SystemExit) as error:  # a bug, or a user's command that calls exit()
            message = one_line(f"unexpected {type(error).__name__}: {error}")
            click.echo(f"error: {message}{_kept(session)}", err=True)
    except KeyboardInterrupt:  # while a message was printed
        pass
    return True


def _kept(session: Session) -> str:
    """Autosave; text about the file, to append to a message, empty if there are no unsaved lines."""
    kept = session.autosave()
    return "" if kept is None else f"; the lines typed so far are in {kept}"


def _watch_terminal() -> None:
    """Send this process SIGHUP when its terminal closes.

    The system does so only if it is the process's controlling terminal, and prompt_toolkit keeps reading a closed one.
    """
    if not (hasattr(select, "poll") and hasattr(signal, "SIGHUP")):
        return
    terminal = select.poll()
    terminal.register(sys.stdin, 0)  # POLLHUP is always reported

    def wait() -> None:
        if any(events & select.POLLHUP for _, events in terminal.poll()):
            os.kill(os.getpid(), signal.SIGHUP)

    threading.Thread(target=wait, daemon=True, name="terminal").start()


def _end(number: int, frame: object) -> NoReturn:
    raise _EndedError


def _lines(names: Callable[[], list[str]], prompt: Callable[[], str], kept: Callable[[], str]) -> Iterator[str]:
    """Lines from the terminal, with history and completion if available. Ctrl-D ends the input only the second time."""
    read = _reader(names)
    ended = False
    while True:
        try:
            line = read(prompt())
        except KeyboardInterrupt:
            continue
        except UnicodeDecodeError:
            click.echo("error: the line could not be read: it is not valid text", err=True)
            continue
        except OSError:  # the terminal is gone
            raise _EndedError from None
        except EOFError:
            if ended:
                return
            ended = True
            try:
                click.echo(f"QUIT leaves, or Ctrl-D once more{kept()}", err=True)
            except OSError:
                raise _EndedError from None
            continue
        except Exception as error:  # a history that cannot be read, …
            if read is input:
                return
            reason = one_line(f"{type(error).__name__}: {error}")
            click.echo(f"error: the line could not be read ({reason}); history and completion are off", err=True)
            read = input
            continue
        ended = False
        yield line


def _reader(names: Callable[[], list[str]]) -> Callable[[str], str]:
    try:
        from prompt_toolkit import PromptSession
        from prompt_toolkit.completion import WordCompleter
        from prompt_toolkit.history import FileHistory

        completer = WordCompleter(names, ignore_case=True)
        session: PromptSession[str] = PromptSession(
            history=FileHistory(str(_HISTORY.expanduser())), completer=completer, complete_while_typing=False
        )
    except ImportError:
        click.echo("for history and completion: pip install 'warpjld[shell]'", err=True)
        return input
    except Exception as error:  # no home folder, an unknown terminal
        click.echo(f"no history and completion: {one_line(str(error))}", err=True)
        return input
    return session.prompt
