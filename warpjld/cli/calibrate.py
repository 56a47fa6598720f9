"""``warpjld calibrate``: fit the covering's parameters to a rig, or to target shapes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.answer import answer

if TYPE_CHECKING:
    from warpjld.covering import Covering, Parameters
    from warpjld.covering.calibrate import Calibration
    from warpjld.covering.fit_targets import TargetFit
    from warpjld.rig import Rig

__all__ = ["calibrate_command"]

_ROWS = {
    "loss": ("loss", ".2f"),
    "volume_rms": ("volume error, typical [%]", ".2f"),
    "volume_worst": ("volume error, worst [%]", "+.2f"),
    "roughness_rms": ("roughness, typical [degrees]", ".2f"),
    "roughness_worst": ("roughness, worst [degrees]", ".2f"),
    "stretch_least": ("edge stretch, least", ".2f"),
    "stretch_largest": ("edge stretch, largest", ".2f"),
    "faces_folded": ("faces folded", "d"),
    "faces_in_contact": ("faces of parts in contact", "d"),
}


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
    "--start", type=click.Path(path_type=Path, dir_okay=False), help="Parameter file to start from; else the defaults."
)
@options.domains
@click.option("--poses", type=click.IntRange(min=1), help="Number of poses to fit to; all of the set by default.")
@click.option(
    "--targets",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Target shapes to fit to: .npz with vertices (frames, V, 3), and the poses as channels and angles.",
)
@click.option(
    "--motion",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Motion file with the pose of every target, if the targets file has none.",
)
@click.option(
    "--iterations",
    type=click.IntRange(min=1),
    default=14,
    show_default=True,
    help="Largest number of optimisation steps.",
)
@options.json
@options.quiet
def calibrate_command(
    rig: str,
    out: Path,
    start: Path | None,
    domains: Literal["geometry", "skin"],
    poses: int | None,
    targets: Path | None,
    motion: Path | None,
    iterations: int,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Fit the covering's parameters to RIG over its joint ranges, so that volume is preserved without folds, roughness
    and stretch. No pose gets worse than with the parameters it starts from.

    With --targets they are fitted to given shapes in given poses: scans, corrective shapes.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd, .usda, .usdc, .usdz), a surface with --skeleton, or builtin:left,
    builtin:right. Scripts read the file with PARAMETERS."""
    from warpjld.cli.progress import progress
    from warpjld.cli.rig_argument import open_rig, rig_files
    from warpjld.covering.kept import bind_kept
    from warpjld.covering.parameters import load_parameters, save_parameters
    from warpjld.errors import InputError
    from warpjld.files.overwriting import check_outputs
    from warpjld.io.identity import files_of
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    if not out.absolute().parent.is_dir():
        raise InputError("cannot write the parameter file: no such folder", path=out.parent)
    if targets is not None and poses is not None:
        raise InputError("--poses limits the built-in set of poses; with --targets all poses of the file are used")
    if targets is None and motion is not None:
        raise InputError("--motion gives the poses of --targets, but there is no --targets")
    read = [path for path in (start, targets, motion) if path is not None]
    check_outputs([out], [*rig_files(rig, how), *read, *(file for path in read for file in files_of(path))])
    opened = open_rig(rig, **how)
    begin = None if start is None else load_parameters(start, opened.skeleton)
    with progress(quiet) as report:
        covering, _ = bind_kept(opened, parameters=begin, domains=domains)
        if targets is None:
            summary, lines, found = _calibrated(covering, poses, iterations, report)
        else:
            summary, lines, found = _fitted(opened, covering, targets, motion, iterations, report)
    save_parameters(out, opened.skeleton, found)
    if as_json:
        answer({"rig": rig, "parameters": str(out), **summary})
    elif not quiet:
        for line in lines:
            click.echo(line)
        click.echo(f"{out} written")


def _calibrated(
    covering: Covering, poses: int | None, iterations: int, report: Any
) -> tuple[dict[str, Any], list[str], Parameters]:
    from warpjld.covering.calibrate import calibrate
    from warpjld.covering.pose_sets import calibration_poses

    found = calibrate(covering, calibration_poses(covering.skeleton, poses), iterations=iterations, progress=report)
    before, after = (
        {"loss": loss, **measures.summary()}
        for loss, measures in zip(found.loss, (found.before, found.after), strict=True)
    )
    summary = {
        "status": found.status.value,
        "poses": found.poses,
        "guarded": found.guards,
        "iterations": found.iterations,
        "evaluations": found.evaluations,
        "seconds": round(found.seconds, 2),
        "kept": list(found.kept),
        "before": before,
        "after": after,
    }
    return summary, _table(found, before, after), found.parameters


def _table(found: Calibration, before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    lines = [
        f"{found.poses} poses, {found.guards} more guarded, {found.iterations} iterations, {found.seconds:.1f} s",
        f"{'':30}{'before':>9}{'after':>9}",
    ]
    for key, (name, form) in _ROWS.items():
        lines.append(f"{name:30}{format(before[key], form):>9}{format(after[key], form):>9}")
    if found.kept:
        joints = f"{len(found.kept)} joint{'s' * (len(found.kept) != 1)}"
        lines.append(f"note: {joints} returned towards the start, since poses would have got worse")
    return [*lines, found.status.value]


def _fitted(
    rig: Rig, covering: Covering, targets: Path, motion: Path | None, iterations: int, report: Any
) -> tuple[dict[str, Any], list[str], Parameters]:
    from warpjld.cli.warn import warn
    from warpjld.covering.fit_targets import fit_targets
    from warpjld.motion.target_file import read_targets

    wanted = read_targets(targets, rig, motion=motion)
    warn(wanted.warnings)
    found = fit_targets(covering, wanted.poses, wanted.vertices, iterations=iterations, progress=report)
    before, after = ({"rms_mm": 1e3 * found.rms[k], "largest_mm": 1e3 * found.farthest[k]} for k in (0, 1))
    summary = {
        "targets": str(targets),
        "poses": len(wanted.poses),
        "seconds": round(found.seconds, 2),
        "before": before,
        "after": after,
        "rms_mm_of_pose": [[1e3 * a, 1e3 * b] for a, b in zip(found.before, found.after, strict=True)],
        "warnings": list(wanted.warnings),
    }
    return summary, _target_table(found), found.parameters


def _target_table(found: TargetFit) -> list[str]:
    rms, far = found.rms, found.farthest
    worst = int(found.after.argmax())
    return [
        f"{len(found.before)} target shapes, {found.seconds:.1f} s",
        f"{'':30}{'before':>9}{'after':>9}",
        f"{'distance, typical [mm]':30}{1e3 * rms[0]:>9.3f}{1e3 * rms[1]:>9.3f}",
        f"{'distance, largest [mm]':30}{1e3 * far[0]:>9.3f}{1e3 * far[1]:>9.3f}",
        f"farthest afterwards: shape {worst}, {1e3 * found.after[worst]:.3f} mm",
    ]
