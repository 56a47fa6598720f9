"""The command line interface: one file per command, imported when the command is called."""

from __future__ import annotations

import importlib
import io
import os
import signal
import sys
import traceback

import click

from warpjld import __version__
from warpjld.cli.warn import one_line
from warpjld.errors import WarpjldError
from warpjld.limits import LIMITS, set_limit
from warpjld.suggest import one_of

__all__ = ["command_group", "main"]

_FAULT = 70  # EX_SOFTWARE of sysexits.h
_TRACEBACK = "WARPJLD_TRACEBACK"

_COMMANDS = {
    "run": "Run a script: animation, grasping, contact; pictures, films, exports.",
    "shell": "Type the commands of scripts one by one, with immediate results.",
    "studio": "Edit a script in the browser, with a 3D view: pose, set keys, grasp, press.",
    "example": "List, run or copy the examples that come with the package.",
    "inspect": "Report what was recognised in a rig.",
    "place": "Propose the named points of a body or hand for a surface without joints.",
    "calibrate": "Fit the covering's parameters to a rig.",
    "bind": "Bind a rig once and save the binding to a file.",
    "deform": "Deform a rig by a motion file.",
    "bake": "Write a rig for game engines: fitted skin weights and corrective shapes.",
    "study": "Run many grasps and collect them in one table.",
    "score": "Measure grasps of other programs by the same metrics.",
    "fem": "Load a deformable body and solve for its shape, stresses and reactions.",
    "doctor": "Report what is installed, what works here, and what is missing.",
}
_HELP = """All lengths are metres, angles degrees, forces newtons, pressures pascals. HELP in the shell, or
`echo HELP | warpjld shell`, lists the commands of scripts."""


class _Lazy(click.Group):
    """Command group that imports ``warpjld.cli.NAME`` only when NAME is called, for a short start-up."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in _COMMANDS:
            return None
        command: click.Command = getattr(importlib.import_module(f"warpjld.cli.{name}"), f"{name}_command")
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in _COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"there is no command '{args[0]}'{one_of(args[0], _COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


def _limits() -> str:
    return "; ".join(f"{name} {bound.most:,}" for name, bound in LIMITS.items())


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"]}, epilog=_HELP)
@click.version_option(__version__, prog_name="warpjld")
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="NAME=NUMBER",
    help=f"Raise or lower a limit on what is read or computed, before the command; repeatable. {_limits()}.",
)
def command_group(limits: tuple[str, ...]) -> None:
    """Hands and bodies deformed by Joint-dependent Local Deformations, without painted weights."""
    for assignment in limits:
        name, _, value = assignment.partition("=")
        set_limit(name.strip(), value)


def _terminated(number: int, frame: object) -> None:
    """SIGTERM cleans up as Ctrl-C does, and keeps finished results. Those that follow, as where a group of processes is
    ended and each of them passes it on, do not cut that off."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt


def main(arguments: list[str] | None = None) -> None:
    """Run the command line.

    Exit codes: 0 done, 1 bad input or a failed job, 2 wrong usage, 70 a bug in the program, 130 interrupted.
    """
    signal.signal(signal.SIGTERM, _terminated)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # file names may not be valid text
    try:
        code = command_group.main(arguments, prog_name="warpjld", standalone_mode=False)
    except click.exceptions.Abort:
        click.echo("interrupted", err=True)
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        sys.exit(130)
    except WarpjldError as error:
        click.echo(f"error: {one_line(str(error))}", err=True)
        sys.exit(1)
    except OSError as error:  # a full disk, a folder that was removed: a traceback would add nothing
        what = f"{error.filename or 'standard output or a file'}: {error.strerror or error}"
        click.echo(f"error: {one_line(what)}", err=True)
        sys.exit(1)
    except MemoryError as error:
        click.echo(f"error: not enough memory{f': {error}' if str(error) else ''}", err=True)
        sys.exit(1)
    except Exception as error:
        if os.environ.get(_TRACEBACK):
            raise
        click.echo(f"error: {_unexpected(error)}", err=True)
        sys.exit(_FAULT)
    sys.exit(code if isinstance(code, int) else 0)


def _unexpected(error: Exception) -> str:
    """One line about an unexpected exception: what it is and where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" at {os.path.basename(frames[-1].filename)}:{frames[-1].lineno}" if frames else ""
    return one_line(
        f"unexpected {type(error).__name__}{where}: {error} (a bug in warpjld, please report it; with "
        f"{_TRACEBACK}=1 set the same command shows the traceback)"
    )
