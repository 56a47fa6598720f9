"""``warpjld score``: measure grasps of other programs with the metrics of a grasp study."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.study_answer import tell
from warpjld.cli.warn import warn

__all__ = ["score_command"]


@click.command("score")
@click.argument("grasps", type=click.Path(path_type=Path))
@options.out_folder
@click.option("--hand", metavar="RIG", help="The hand: a rig file, builtin:left or builtin:right.")
@click.option("--objects", type=click.Path(path_type=Path), help="Folder of surfaces, in the frame of the grasps.")
@click.option("--object-unit", "unit", default="m", show_default=True, help="Their unit: m, dm, cm, mm, in.")
@click.option(
    "--plan",
    type=click.Path(path_type=Path),
    help="Study file with hands, objects and [measuring], instead of --hand and --objects.",
)
@click.option(
    "--map", "joint_map", type=click.Path(path_type=Path), help="Joint map (JSON): the hand's angle for each joint."
)
@click.option("--friction", type=float, default=0.6, show_default=True, help="Coefficient for grasps without one.")
@click.option(
    "--flat-hand-mean/--no-flat-hand-mean",
    default=None,
    help="Whether zero rotations of a MANO pose mean the flat hand, if the file does not say.",
)
@click.option(
    "--frames",
    type=click.Choice(["last", "all"]),
    default="last",
    show_default=True,
    help="Whether a recording's last frame is the grasp, or every frame.",
)
@options.trial_processes
@options.table_format
@options.fresh_start
@options.device_of_study
@options.ray
@options.allow_mixed
@options.json
@options.quiet
def score_command(
    grasps: Path,
    out: Path,
    hand: str | None,
    processes: int | None,
    table: Literal["parquet", "csv", "both"],
    fresh: bool,
    ray: str | None,
    allow_mixed: bool,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Measure GRASPS, a file or folder, on deformed skin, and write the table of a grasp study with a row for each.

    Formats: a study's folder, isaac_grasp YAML 1.0, DexGraspBench and GraspXL .npy (pickles are never executed), CSV of
    joint angles in degrees, and surfaces as written by study --export mesh."""
    from warpjld.cli.progress import progress
    from warpjld.runtime.quiet import silence_warp
    from warpjld.study.run import run_study
    from warpjld.study.scoring import given_scores, hand_choice

    silence_warp()
    with progress(quiet) as report:
        report("reading grasps, hand and objects", 0, 1)
        chosen = None if hand is None else hand_choice(hand)
        experiment = given_scores(grasps, hand=chosen, **how)
        notes, doubts = experiment.check()
        warn(doubts, "suspicious")
        try:
            where: dict[str, Any] = {"processes": processes, "ray": ray, "allow_mixed": allow_mixed}
            result = run_study(experiment, out, **where, table=table, fresh=fresh, title=grasps.name, report=report)
        except KeyboardInterrupt:
            click.echo(f"stopped; the same command continues from what is in {out}", err=True)
            raise
    warn(result.notes)
    tell(result, notes, as_json, quiet, what="grasps")
