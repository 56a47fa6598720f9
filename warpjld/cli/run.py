"""``warpjld run``: run a script and write its outputs."""

from __future__ import annotations

from pathlib import Path

import click

from warpjld.cli import options
from warpjld.cli.answer import answer

__all__ = ["run_command"]


@click.command("run")
@click.argument("script", type=click.Path(path_type=Path))
@options.out_folder
@options.device_of_script
@options.threads
@options.commands
@click.option("--check", is_flag=True, help="Check the script and list its outputs; compute nothing.")
@click.option("--html", is_flag=True, help="Also write the animation as an interactive HTML page.")
@options.json
@options.quiet
def run_command(
    script: Path,
    out: Path,
    device: str,
    threads: int | None,
    commands: tuple[Path, ...],
    check: bool,
    html: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run SCRIPT and write the pictures, films and exports that it specifies; if it specifies none, an animated surface
    (NPZ), a film and a contact sheet. A summary is written to summary.json in the output folder."""
    from warpjld.cli.progress import progress
    from warpjld.runtime.quiet import silence_warp
    from warpjld.script.run_script import run_script
    from warpjld.script.summary import table

    silence_warp()

    def say(text: str) -> None:
        if not quiet:
            click.echo(text, err=as_json)

    with progress(quiet) as report:
        summary = run_script(
            script,
            out,
            commands=commands,
            check=check,
            page=html,
            device=device,
            threads=threads,
            say=say,
            progress=report,
        )
    if as_json:
        answer(summary)
    elif not quiet:
        table(summary, click.echo)
