"""``warpjld calibrate``: fit the covering's parameters to a rig and write them to a file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.answer import answer

if TYPE_CHECKING:
    from warpjld.covering.calibrate import Calibration, PoseQuality

__all__ = ["command"]


@click.command("calibrate")
@click.argument("rig")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default="parameters.json",
    show_default=True,
    help="Parameter file to write.",
)
@options.rig
@click.option(
    "--start", type=click.Path(path_type=Path, dir_okay=False), help="Parameter file to begin with; else the defaults."
)
@options.domains
@click.option("--poses", type=click.IntRange(min=1), help="How many poses to fit to; all of the set by default.")
@click.option(
    "--iterations", type=click.IntRange(min=1), default=120, show_default=True, help="Most iterations of the minimiser."
)
@options.json
@options.quiet
def command(
    rig: str,
    out: Path,
    start: Path | None,
    domains: Literal["geometry", "skin"],
    poses: int | None,
    iterations: int,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Fit the covering's parameters to RIG over its joint ranges: volume kept, least stretch.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd, .usda, .usdc, .usdz), a surface with --skeleton, or builtin:left,
    builtin:right. Scripts load the file written with PARAMETERS. The result is never worse than the start."""
    from warpjld.cli.progress import progress
    from warpjld.cli.rig_argument import open_rig, rig_files
    from warpjld.covering.calibrate import calibrate
    from warpjld.covering.kept import bind_kept
    from warpjld.covering.parameters import load_parameters, save_parameters
    from warpjld.covering.pose_sets import calibration_poses
    from warpjld.errors import InputError
    from warpjld.overwriting import check_outputs
    from warpjld.quiet import silence_warp

    silence_warp()
    if not out.absolute().parent.is_dir():
        raise InputError("cannot write the parameter file: no such folder", path=out.parent)
    check_outputs([out], rig_files(rig, how))
    opened = open_rig(rig, **how)
    begin = None if start is None else load_parameters(start, opened.skeleton)
    with progress(quiet) as report:
        covering, _ = bind_kept(opened, parameters=begin, domains=domains)
        chosen = calibration_poses(opened.skeleton, poses)
        found = calibrate(covering, chosen, iterations=iterations, progress=report)
    save_parameters(out, opened.skeleton, found.parameters)
    if as_json:
        answer(_summary(rig, out, found))
    elif not quiet:
        _table(found)
        click.echo(f"{found.status.value}; {out} written")


def _summary(rig: str, out: Path, found: Calibration) -> dict[str, Any]:
    return {
        "rig": rig,
        "parameters": str(out),
        "status": found.status.value,
        "poses": found.poses,
        "iterations": found.iterations,
        "evaluations": found.evaluations,
        "seconds": round(found.seconds, 2),
        "before": asdict(found.before),
        "after": asdict(found.after),
    }


def _table(found: Calibration) -> None:
    click.echo(f"{found.poses} poses, {found.iterations} iterations, {found.seconds:.1f} s")
    click.echo(f"{'':28}{'before':>9}{'after':>9}")
    for (name, before), (_, after) in zip(_rows(found.before), _rows(found.after), strict=True):
        click.echo(f"{name:28}{before:>9}{after:>9}")


def _rows(quality: PoseQuality) -> list[tuple[str, str]]:
    stretch = quality.stretch
    return [
        ("loss", f"{quality.loss:.4f}"),
        ("volume error, typical", f"{100.0 * quality.volume_mean:.2f} %"),
        ("volume error, worst", f"{100.0 * quality.volume_worst:+.2f} %"),
        ("edge stretch, smallest", f"{stretch.smallest:.2f}"),
        ("edge stretch, 1 %", f"{stretch.low:.2f}"),
        ("edge stretch, 99 %", f"{stretch.high:.2f}"),
        ("edge stretch, largest", f"{stretch.largest:.2f}"),
        ("faces folded", f"{quality.folds}"),
        ("faces of parts in contact", f"{quality.contacts}"),
    ]
