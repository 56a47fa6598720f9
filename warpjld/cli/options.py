"""Options shared by several commands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

__all__ = [
    "RIG",
    "allow_mixed",
    "commands",
    "device",
    "device_of_script",
    "device_of_study",
    "domains",
    "fresh_start",
    "json",
    "out_folder",
    "parameters",
    "quiet",
    "ray",
    "rig",
    "table_format",
    "threads",
    "trial_processes",
]

Decorator = Callable[[Callable[..., None]], Callable[..., None]]

out_folder: Decorator = click.option(
    "-o", "--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Output folder."
)
device: Decorator = click.option("--device", default="cpu", show_default=True, help="Where to compute: cpu, cuda:0, …")
device_of_study: Decorator = click.option(
    "--device",
    default="cpu",
    show_default=True,
    help="Where hands close, and distances to objects and the skin are computed: cpu, cuda:0, …; distances to the "
    "skin, contacts, force closure and [contact] stay on the CPU.",
)
device_of_script: Decorator = click.option(
    "--device",
    default="cpu",
    show_default=True,
    help="Where the skin, flexion searches, closing hands and distances to objects are computed: cpu, cuda:0, …; "
    "judging grasps, TOUCH and PRESS stay on the CPU.",
)
threads: Decorator = click.option(
    "--threads", type=click.IntRange(min=1), help="CPU threads; chosen automatically by default."
)
commands: Decorator = click.option(
    "--commands", multiple=True, type=click.Path(path_type=Path), help="Python file that adds commands; repeatable."
)
domains: Decorator = click.option(
    "--domains",
    type=click.Choice(["geometry", "skin"]),
    default="geometry",
    show_default=True,
    help="Source of the vertices' domains: the surface's geometry, or painted weights.",
)
parameters: Decorator = click.option(
    "--parameters", type=click.Path(path_type=Path), help="Covering parameters, a file written by calibrate."
)
ray: Decorator = click.option(
    "--ray",
    metavar="ADDRESS",
    help="Run on a Ray cluster: its address, auto, or local for workers on this machine (extra ray).",
)
allow_mixed: Decorator = click.option(
    "--allow-mixed", is_flag=True, help="With --ray: also use machines whose results differ in the last bits."
)
trial_processes: Decorator = click.option(
    "--processes", type=click.IntRange(min=1), help="Worker processes; by default one per core."
)
table_format: Decorator = click.option(
    "--table",
    type=click.Choice(["parquet", "csv", "both"]),
    default="parquet",
    show_default=True,
    help="Format of the results table.",
)
fresh_start: Decorator = click.option(
    "--fresh", is_flag=True, help="Start again, deleting the trials in the output folder."
)
json: Decorator = click.option("--json", "as_json", is_flag=True, help="Write the result to stdout as JSON.")
quiet: Decorator = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors and warnings.")


RIG = ("skeleton", "points", "side", "unit", "scale", "up", "joint_map", "centre_joints")
"""Names of the options that ``rig`` adds: keyword arguments of ``load_rig``."""


LISTED = Path("-")
"""Value of ``--points`` without a file, for commands that list points."""


def rig(command: Callable[..., Any], *, lists_points: bool = False) -> Callable[..., Any]:
    """Decorator that adds the options for reading a RIG; they are passed as keyword arguments of ``open_rig``.

    Args:
        command: The function to decorate.
        lists_points: Whether ``--points`` may be given without a file; its value is then ``LISTED``.
    """
    points: dict[str, Any] = {"is_flag": False, "flag_value": LISTED} if lists_points else {}
    alone = "; alone: list the points that RIG holds" if lists_points else ""
    for option in (
        click.option(
            "--centre-joints",
            is_flag=True,
            default=None,
            help="Move RIG's joints that are off the centre of a finger's or limb's flesh to the centre (see inspect).",
        ),
        click.option("--up", type=click.Choice(["y", "z"]), help="RIG's up axis; guessed by default."),
        click.option(
            "--scale", type=float, help="Factor for all of RIG's lengths; without --unit the unit is not guessed."
        ),
        click.option("--unit", type=click.Choice(["m", "cm", "mm", "in"]), help="RIG's unit; guessed by default."),
        click.option(
            "--side", type=click.Choice(["left", "right"]), help="Which hand RIG is, if the file does not determine it."
        ),
        click.option(
            "--map",
            "joint_map",
            type=click.Path(path_type=Path),
            help="Joint map (JSON): RIG's own joint by canonical name.",
        ),
        click.option(
            "--points",
            type=click.Path(path_type=Path),
            help=f"Points file for a RIG without joints: 87 named points of a body, 25 of a hand (see place){alone}.",
            **points,
        ),
        click.option("--skeleton", type=click.Path(path_type=Path), help="Skeleton file for a RIG without joints."),
    ):
        command = option(command)
    return command
