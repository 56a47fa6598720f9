"""Output of ``warpjld study`` and ``warpjld score``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from warpjld.cli.answer import answer

if TYPE_CHECKING:
    from warpjld.study import Rerun, StudyResult
    from warpjld.study.grasping import GraspPlan

__all__ = ["tell", "tell_checked", "tell_rerun"]


def tell_checked(path: Path, plan: GraspPlan, notes: list[str], as_json: bool, quiet: bool) -> None:
    """Print the size of a plan."""
    combinations = plan.combinations
    tried = min(combinations, plan.trials)
    if as_json:
        counts = {"trials": plan.trials, "combinations": combinations, "combinations_tried": tried}
        answer({"plan": str(path), **counts, "notes": notes})
    elif not quiet:
        for note in notes:
            click.echo(f"note: {note}")
        factors = (
            "hand, object, scale and friction" if plan.pressing is None else "hand, object, scale, friction and weight"
        )
        of = f"{tried} of {combinations} combinations of {factors}"
        click.echo(f"{path}: {plan.trials} trials of {of}")


def tell(
    result: StudyResult,
    notes: list[str],
    as_json: bool,
    quiet: bool,
    *,
    exported: Sequence[Path] = (),
    what: str = "trials",
) -> None:
    """Print the result of a study; ``what`` is the word for its trials."""
    from dataclasses import asdict

    if as_json:
        summary = {
            "files": [str(file) for file in (*result.files, *exported)],
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
    click.echo(f"{result.ran} {what} run in {result.seconds:.1f} s; {', '.join(str(file) for file in result.files)}")
    if exported:
        click.echo(f"{len(exported)} files exported, the first {exported[0]}")


def tell_rerun(again: Rerun, as_json: bool, quiet: bool) -> None:
    """Print the result of a rerun; exits with code 1 if it differs from the study."""
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
