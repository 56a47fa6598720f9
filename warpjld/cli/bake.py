"""``warpjld bake``: skin weights and corrective shapes for game engines, fitted to the covering."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.answer import answer

if TYPE_CHECKING:
    from warpjld.baking import Accuracy

__all__ = ["bake_command"]


@click.command("bake")
@click.argument("rig")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="File to write: .glb, .usd, .usda or .usdc; the drivers of correctives are written to NAME.correctives.json.",
)
@options.rig
@click.option(
    "--poses",
    "motions",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Motion to fit to, in addition to the range of motion; its last quarter is used for the report. Repeatable.",
)
@click.option(
    "--influences",
    type=click.Choice(["4", "8"]),
    default="4",
    show_default=True,
    help="Largest number of joints per vertex.",
)
@click.option(
    "--correctives", type=click.IntRange(0, 128), default=0, show_default=True, help="Number of corrective shapes."
)
@click.option(
    "--clip", type=click.Path(path_type=Path), help="Motion to include as an animation, with the shapes' weights."
)
@click.option(
    "--report",
    "table",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Errors on poses that were not fitted, as .csv or .json.",
)
@options.parameters
@options.domains
@options.json
@options.quiet
def bake_command(
    rig: str,
    out: Path,
    motions: tuple[Path, ...],
    influences: str,
    correctives: int,
    clip: Path | None,
    table: Path | None,
    parameters: Path | None,
    domains: Literal["geometry", "skin"],
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Fit skin weights, and corrective shapes driven by joint rotations, to RIG's covering, and write a file for game
    engines: RIG's own joints and bind pose, a skin, morph targets.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd, .usda, .usdc, .usdz), a surface with --skeleton, or builtin:left,
    builtin:right."""
    from warpjld.baking import accuracy, bake, write_baked, write_report
    from warpjld.baking.motions import with_motions
    from warpjld.baking.report import check_report
    from warpjld.baking.write import check_baked, drivers_file
    from warpjld.cli.progress import progress
    from warpjld.cli.rig_argument import open_rig, rig_files
    from warpjld.cli.warn import warn
    from warpjld.covering import load_parameters
    from warpjld.covering.kept import bind_kept
    from warpjld.files.folders import make_folder
    from warpjld.files.overwriting import check_outputs
    from warpjld.io.identity import files_of
    from warpjld.motion import load_motion
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    check_baked(out)
    outputs = [out, *([drivers_file(out)] if correctives else [])]
    if table is not None:
        check_report(table)
        outputs.append(table)
    read = dict.fromkeys(path for path in (*motions, clip) if path is not None)
    inputs = [file for path in read for file in (path, *files_of(path))]
    check_outputs(outputs, [*rig_files(rig, how | {"parameters": parameters}), *inputs])
    opened = open_rig(rig, **how)
    chosen = None if parameters is None else load_parameters(parameters, opened.skeleton)
    loaded = [load_motion(path, opened) for path in motions]
    shown = None if clip is None else load_motion(clip, opened)
    warnings = [line for motion in (*loaded, *([shown] if shown else [])) for line in motion.warnings]
    if opened.skin is None:
        warnings.append("the rig has no painted weights: the report cannot compare the fitted ones with any")
    with progress(quiet) as report:
        covering, _ = bind_kept(opened, parameters=chosen, domains=domains)
        fitted, unseen = with_motions(opened.skeleton, [motion.poses for motion in loaded])
        baked = bake(opened, covering, fitted, influences=int(influences), correctives=correctives, progress=report)
        rows = accuracy(baked, covering, unseen)
        written = write_baked(out, baked, shown.poses if shown else None, rate=shown.rate if shown else 30.0)
    if table is not None:
        make_folder(table.parent)
        write_report(table, rows)
    warn(dict.fromkeys([*warnings, *written.warnings]))
    summary = {
        "rig": rig,
        "files": [str(path) for path in outputs],
        "influences": int(influences),
        "correctives": len(baked.correctives),
        "poses": len(fitted),
        "unseen": [asdict(row) for row in rows],
        "warnings": [*opened.suspicious, *warnings, *written.warnings],
        "notes": list(written.notes),
    }
    if as_json:
        answer(summary)
    elif not quiet:
        _print(summary, rows)


def _print(summary: dict[str, Any], rows: list[Accuracy]) -> None:
    _table(rows, summary["poses"])
    click.echo(f"{', '.join(summary['files'])} written")
    for note in summary["notes"]:
        click.echo(f"note: {note}")


def _table(rows: list[Accuracy], fitted: int) -> None:
    click.echo(f"fitted to {fitted} poses; on others, distance from the covering in mm (RMS / largest):")
    click.echo(f"{'':14}{'painted':>16}{'weights':>16}{'with shapes':>16}")
    for row in rows:
        cells = (
            (row.painted_rms, row.painted_largest),
            (row.weights_rms, row.weights_largest),
            (row.corrected_rms, row.corrected_largest),
        )
        cells_shown = (f"{a:8.3f} /{b:6.2f}" if a is not None and b is not None else "-" for a, b in cells)
        click.echo(f"{row.poses:14}" + "".join(f"{text:>16}" for text in cells_shown))
