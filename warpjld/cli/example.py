"""``warpjld example``: list, run or copy the examples that come with the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import click

from warpjld.cli import options
from warpjld.errors import InputError, WarpjldError
from warpjld.suggest import did_you_mean

__all__ = ["example_command", "example_files", "examples_folder"]

_SUFFIXES = (".jld", ".toml", ".py")
_WITH = {"user_command.jld": ("user_command.py",), "grasp_objects.py": ("grasp_objects.toml",)}
"""Further files that an example needs."""
_NO_EXAMPLE = ("user_command.py", "grasp_objects.toml", "grasp_real_objects.toml")
"""Files that are part of another example, or need assets that do not come with the package."""


def examples_folder() -> Path:
    """Folder of the examples: in the installed package, or next to it in a checkout.

    Raises:
        WarpjldError: There is none.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "examples", package.parent / "examples"):
        if (folder / "fist.jld").is_file():
            return folder
    raise WarpjldError("the examples were not installed with this package")


def example_files() -> dict[str, Path]:
    """Files of the examples by name, which is the file's stem."""
    files = [
        file
        for file in sorted(examples_folder().iterdir())
        if file.suffix in _SUFFIXES and file.name not in _NO_EXAMPLE
    ]
    return {file.stem: file for file in files}


@click.command("example", context_settings={"ignore_unknown_options": True})
@click.argument("name", required=False)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
@options.out_folder
@click.option("--copy", is_flag=True, help="Copy the example's files into the output folder instead of running it.")
@options.json
@options.quiet
@click.pass_context
def example_command(
    ctx: click.Context,
    name: str | None,
    arguments: tuple[str, ...],
    out: Path,
    copy: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """List the examples that come with the package; run the one called NAME, or copy its files.

    Scripts (.jld) and studies (.toml) write into the output folder; programs (.py) run in it, with the ARGUMENTS that
    the listing names.
    """
    files = example_files()
    if name is None:
        _list(files, as_json)
        return
    file = files.get(name.rpartition(".")[0] or name)
    if file is None:
        raise InputError(f"there is no example '{name}'{did_you_mean(name, files)}; warpjld example lists them")
    if copy:
        _copy(file, out, quiet)
    elif file.suffix == ".py":
        _run_program(file, arguments, out)
    else:
        if arguments:
            raise InputError(f"example {name} takes no arguments, got {' '.join(arguments)}")
        _run_file(ctx, file, out, as_json, quiet)


def _first_line(file: Path) -> str:
    """First line of a file, which describes it."""
    line = file.read_text(encoding="utf-8").partition("\n")[0]
    return line.strip('#" ').replace("``", "")


def _list(files: dict[str, Path], as_json: bool) -> None:
    from warpjld.cli.answer import answer

    described = {name: _first_line(file) for name, file in files.items()}
    if as_json:
        answer({name: {"file": str(files[name]), "shows": text} for name, text in described.items()})
        return
    for name, text in described.items():
        click.echo(f"{name:24} {text}")
    click.echo("\nwarpjld example NAME -o out runs one, --copy copies its files; they are in " + str(examples_folder()))


def _copy(file: Path, out: Path, quiet: bool) -> None:
    from warpjld.files.folders import make_folder

    make_folder(out)
    for name in (file.name, *_WITH.get(file.name, ())):
        target = out / name
        if target.exists():
            raise InputError("exists already", path=target)
        shutil.copyfile(file.with_name(name), target)
        if not quiet:
            click.echo(target)


def _run_program(file: Path, arguments: tuple[str, ...], out: Path) -> None:
    """Run a Python example in a process, in the output folder; arguments that name files become absolute paths."""
    from warpjld.files.folders import make_folder

    make_folder(out)
    given = [os.path.abspath(argument) if os.path.exists(argument) else argument for argument in arguments]
    done = subprocess.run([sys.executable, str(file), *given], cwd=out, check=False)
    if done.returncode:
        raise WarpjldError(f"{file.name} ended with exit code {done.returncode}")


def _run_file(ctx: click.Context, file: Path, out: Path, as_json: bool, quiet: bool) -> None:
    """Run a script or study with the command for such files."""
    from warpjld.cli import fem, run, study

    shared = {"out": out, "as_json": as_json, "quiet": quiet}
    if file.suffix == ".jld":
        more = tuple(file.with_name(name) for name in _WITH.get(file.name, ()))
        ctx.invoke(run.run_command, script=file, commands=more, **shared)
    elif "[[hands]]" in file.read_text(encoding="utf-8"):
        ctx.invoke(study.study_command, plan=file, table=_table_format(), **shared)
    else:
        ctx.invoke(fem.fem_command, study=file, **shared)


def _table_format() -> str:
    """Parquet if it is installed, else CSV, since examples should not need an extra."""
    from warpjld.errors import MissingExtraError
    from warpjld.tables.files import require_parquet

    try:
        require_parquet()
    except MissingExtraError:
        return "csv"
    return "parquet"
