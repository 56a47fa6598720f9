"""``warpjld study``: many grasps, planned in a TOML file, brought into one table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from warpjld.cli import options
from warpjld.cli.answer import answer
from warpjld.cli.warn import warn

if TYPE_CHECKING:
    from warpjld.study import Rerun, StudyResult
    from warpjld.study.grasping import GraspPlan

__all__ = ["command"]


@click.command("study")
@click.argument("plan", type=click.Path(path_type=Path))
@options.out_folder
@click.option("--processes", type=click.IntRange(min=1), help="Worker processes; one a core by default.")
@click.option(
    "--table",
    type=click.Choice(["parquet", "csv", "both"]),
    default="parquet",
    show_default=True,
    help="Format of the results table.",
)
@click.option("--fresh", is_flag=True, help="Start again, forgetting the trials in the output folder.")
@click.option("--rerun", "row", type=click.IntRange(min=0), metavar="ROW", help="Repeat one trial, with pictures.")
@click.option("--check", is_flag=True, help="Read the plan and load its hands and objects; run nothing.")
@options.json
@options.quiet
def command(
    plan: Path,
    out: Path,
    processes: int | None,
    table: Literal["parquet", "csv", "both"],
    fresh: bool,
    row: int | None,
    check: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run the grasp study PLAN (TOML), or go on where it was stopped.

    Leaves a table, the poses, a manifest and a summary in the output folder. The table is the same, byte for byte,
    whatever the number of processes and however often the study was stopped."""
    from warpjld.cli.progress import progress
    from warpjld.errors import InputError
    from warpjld.runtime.quiet import silence_warp
    from warpjld.study.grasping import Study

    silence_warp()
    study = Study.load(plan)
    if row is not None:
        if fresh or check:
            raise InputError("--rerun repeats a trial that is there: --fresh and --check do not go with it")
        with progress(quiet) as report:
            again = study.rerun(out, row, report=report)
        _tell_rerun(again, as_json, quiet)
        return
    with progress(quiet) as report:
        report("loading hands and objects", 0, 1)
        notes, doubts = study.check()
        warn(doubts, "suspicious")
        if not check:
            try:
                result = study.run(out, processes=processes, table=table, fresh=fresh, report=report)
            except KeyboardInterrupt:
                click.echo(f"stopped; the same command goes on from what is in {out}", err=True)
                raise
    if check:
        _tell_checked(plan, study.plan, notes, as_json, quiet)
        return
    warn(result.notes)
    _tell(result, notes, as_json, quiet)


def _tell_checked(path: Path, plan: GraspPlan, notes: list[str], as_json: bool, quiet: bool) -> None:
    combinations = len(plan.hands) * len(plan.objects) * len(plan.scales) * len(plan.frictions)
    tried = min(combinations, plan.trials)
    if as_json:
        counts = {"trials": plan.trials, "combinations": combinations, "combinations_tried": tried}
        answer({"plan": str(path), **counts, "notes": notes})
    elif not quiet:
        for note in notes:
            click.echo(f"note: {note}")
        of = f"{tried} of {combinations} combinations of hand, object, scale and friction"
        click.echo(f"{path}: {plan.trials} trials of {of}")


def _tell(result: StudyResult, notes: list[str], as_json: bool, quiet: bool) -> None:
    from dataclasses import asdict

    if as_json:
        summary = {
            "files": [str(file) for file in result.files],
            "rates": [asdict(rate) for rate in result.rates],
            "trials_run": result.ran,
            "seconds": round(result.seconds, 3),
            "notes": notes,
        }
        answer(summary)
        return
    if quiet:
        return
    for note in notes:
        click.echo(f"note: {note}")
    for rate in result.rates:
        name = f"{rate.group} {rate.value}" if rate.group else "all"
        ended = ", ".join(f"{status} {count}" for status, count in rate.statuses.items())
        share = f"{100 * rate.rate:5.1f} %  ({100 * rate.low:.0f}–{100 * rate.high:.0f} %)"
        click.echo(f"{name:32} {rate.successes:5d} of {rate.trials:5d}  {share:20}  {ended}")
    click.echo(f"{result.ran} trials run in {result.seconds:.1f} s; {', '.join(str(file) for file in result.files)}")


def _tell_rerun(again: Rerun, as_json: bool, quiet: bool) -> None:
    same = not again.differences
    if as_json:
        files = [str(file) for file in again.files]
        content = {"row": again.row, "differences": again.differences, "files": files}
        answer(content)
    elif not quiet:
        for name, value in again.row.items():
            shown = f"{value:.6g}" if isinstance(value, float) else value
            click.echo(f"{name:16} {'' if value is None else shown}")
        click.echo("the same as in the study, bit for bit" if same else f"differs in: {', '.join(again.differences)}")
        click.echo(", ".join(str(file) for file in again.files))
    if not same:
        raise SystemExit(1)
