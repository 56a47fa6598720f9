"""``warpjld study``: run a grasp study planned in a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.study_answer import tell, tell_checked, tell_rerun
from warpjld.cli.warn import warn

__all__ = ["study_command"]


@click.command("study")
@click.argument("plan", type=click.Path(path_type=Path))
@options.out_folder
@options.trial_processes
@options.table_format
@options.fresh_start
@click.option(
    "--rerun", "row", type=click.IntRange(min=0), metavar="ROW", help="Repeat one trial, compare it, and draw it."
)
@click.option(
    "--export",
    "exports",
    multiple=True,
    type=click.Choice(["isaac", "dexgraspbench", "mesh"]),
    help="Also write the closed hands in this format into OUT/export; repeatable.",
)
@click.option("--only", metavar="ROWS", help="Trials that --export writes, such as 0-9,17; by default all that closed.")
@click.option("--check", is_flag=True, help="Check the plan and load its hands and objects; run nothing.")
@options.device_of_study
@options.ray
@options.allow_mixed
@options.json
@options.quiet
def study_command(
    plan: Path,
    out: Path,
    processes: int | None,
    table: Literal["parquet", "csv", "both"],
    fresh: bool,
    row: int | None,
    exports: tuple[str, ...],
    only: str | None,
    check: bool,
    device: str,
    ray: str | None,
    allow_mixed: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run the grasp study PLAN (TOML), or continue where it was stopped.

    A table, the poses, a manifest and a summary are written to the output folder. The table is the same, byte for byte,
    for any number of processes and however often the study was stopped."""
    from warpjld.cli.progress import progress
    from warpjld.errors import InputError
    from warpjld.runtime.quiet import silence_warp
    from warpjld.study.grasping import Study

    silence_warp()
    study = Study.load(plan, device=device)
    trials = rows_of(only)
    if trials is not None and not exports:
        raise InputError("--only chooses the trials that --export writes, but there is no --export")
    if row is not None:
        if fresh or check or exports:
            raise InputError("--rerun cannot be combined with --fresh, --check or --export")
        with progress(quiet) as report:
            again = study.rerun(out, row, report=report)
        tell_rerun(again, as_json, quiet)
        return
    with progress(quiet) as report:
        report("loading hands and objects", 0, 1)
        notes, doubts = study.check()
        warn(doubts, "suspicious")
        if check:
            tell_checked(plan, study.plan, notes, as_json, quiet)
            return
        try:
            where: dict[str, Any] = {"ray": ray, "allow_mixed": allow_mixed}
            result = study.run(out, processes=processes, table=table, fresh=fresh, **where, report=report)
            exported = study.export(out, exports, trials=trials) if exports else []
        except KeyboardInterrupt:
            click.echo(f"stopped; the same command continues from what is in {out}", err=True)
            raise
    warn(result.notes)
    tell(result, notes, as_json, quiet, exported=exported)


def rows_of(text: str | None) -> list[int] | None:
    """Numbers in a list such as ``0-9,17``.

    Raises:
        InputError: Not such a list.
    """
    from warpjld.errors import InputError

    if text is None:
        return None
    rows: list[int] = []
    for part in text.split(","):
        first, dash, last = (piece.strip() for piece in part.partition("-"))
        if not first.isdecimal() or (dash and not last.isdecimal()) or len(first + last) > 14:
            raise InputError(f"--only: want numbers of trials such as 0-9,17, got '{part.strip()[:40]}'")
        rows += range(int(first), int(last or first) + 1)
    return list(dict.fromkeys(rows))
