"""``warpjld deform``: deform a rig by motion files and write vertex caches or motion files."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from warpjld.cli import options
from warpjld.cli.answer import answer
from warpjld.cli.deform_wanted import Wanted, count, tell_rig
from warpjld.cli.warn import warn
from warpjld.errors import InputError
from warpjld.files.overwriting import check_outputs
from warpjld.io.caches import FORMATS
from warpjld.motion.out import MOTION_OUT

if TYPE_CHECKING:
    from warpjld.batch import ClipJob

__all__ = ["deform_command"]


@click.command("deform")
@click.argument("rig")
@click.argument("clips", nargs=-1, type=click.Path(path_type=Path), metavar="[MOTION]...")
@click.option("--motion", "motions", multiple=True, type=click.Path(path_type=Path), help="A motion, as MOTION.")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    help=f"Cache to write ({', '.join(FORMATS)}); for a batch the output folder.",
)
@click.option(
    "--motion-out",
    "motions_out",
    multiple=True,
    type=click.Path(path_type=Path),
    help=f"Also write the motion of RIG's own joints ({', '.join(MOTION_OUT)}); repeatable.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice([suffix.lstrip(".") for suffix in FORMATS]),
    help="Batch: write a cache of this format for every motion into the folder --out; repeatable.",
)
@click.option(
    "--motion-format",
    "motion_formats",
    multiple=True,
    type=click.Choice([suffix.lstrip(".") for suffix in MOTION_OUT]),
    help="Batch: write the motion of RIG's own joints in this format, as NAME.motion.bvh; repeatable.",
)
@options.rig
@click.option("--animation", help="Which animation of the motion file, by name, or all; the first by default.")
@click.option("--motion-side", type=click.Choice(["left", "right"]), help="Which hand a recording is of.")
@click.option(
    "--flat-hand-mean/--no-flat-hand-mean",
    default=None,
    help="Whether zero rotations in MANO poses mean the flat hand or MANO's mean pose, if the file does not say.",
)
@click.option("--frames", "span", metavar="A:B", help="Only frames A to B, both included, the motion's first being 0.")
@click.option("--rate", type=float, help="Frames per second; by default the motion's own, 30 for CSV.")
@click.option(
    "--limits",
    type=click.Choice(["error", "clamp", "ignore"]),
    default="error",
    show_default=True,
    help="What to do with CSV angles beyond a joint's limit.",
)
@options.parameters
@click.option("--binding", type=click.Path(path_type=Path), help="Binding of RIG, as bind writes it.")
@options.domains
@click.option(
    "--method",
    type=click.Choice(["smooth", "paper"]),
    default="smooth",
    show_default=True,
    help="Smooth domain borders, or one segment per vertex as published.",
)
@click.option(
    "--touch",
    type=click.Choice(["off", "on", "limit"]),
    default="off",
    show_default=True,
    help="Push skin out of other skin (for display, without forces); limit: digits also stop where they touch.",
)
@click.option("--processes", type=click.IntRange(min=1), help="Worker processes of a batch; by default one per core.")
@click.option("--fresh", is_flag=True, help="Start a batch again, ignoring what the folder already holds.")
@options.device
@options.threads
@options.json
@options.quiet
def deform_command(rig: str, clips: tuple[Path, ...], motions: tuple[Path, ...], **given: Any) -> None:
    """Deform RIG by MOTION files and write the animated surface in the vertex order of RIG's file, or the motion of
    its joints.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd), a surface with --skeleton, or builtin:left or builtin:right for
    the built-in hand. A MOTION is .bvh, .csv, a file with animations (.glb, .gltf, .vrma, .fbx, .usd) or a recording
    of hands (.json, .jsonl, .npz, .npy). With --format or --motion-format it is a batch of any number of clips: RIG is
    bound once, clips are made in several processes, a clip that fails does not end the others, and the same command
    continues where it was stopped. manifest.json lists inputs and outputs of every clip.
    """
    from warpjld.batch import clip_jobs

    jobs = clip_jobs([*motions, *clips], given["animation"])
    if not jobs:
        raise InputError("deform: want a motion file after RIG")
    how = {name: given.pop(name) for name in options.RIG}
    for name in ("formats", "motion_formats"):
        given[name] = tuple(f".{suffix}" for suffix in dict.fromkeys(given[name]))
    wanted = Wanted(rig, how, **given)
    batch = bool(wanted.formats or wanted.motion_formats)
    if len(jobs) > 1 and not batch:
        raise InputError(f"{len(jobs)} clips: want --format, the format to write for each into the folder --out")
    if batch and wanted.motions_out:
        raise InputError("--motion-out names one file: for a batch use --motion-format")
    if wanted.out is None and (batch or not wanted.motions_out):
        raise InputError(f"deform: want --out, the {'folder' if batch else 'file'} to write")
    check_outputs(wanted.outputs(jobs), wanted.inputs(jobs))
    if batch:
        from warpjld.cli.deform_batch import make_batch

        make_batch(wanted, jobs)
    else:
        _single(wanted, jobs[0])


def _single(wanted: Wanted, job: ClipJob) -> None:
    from warpjld.cli.deform_wanted import checked_parameters, opened_rig
    from warpjld.cli.progress import progress
    from warpjld.cli.read_ahead import ReadAhead
    from warpjld.io.caches import check_cache
    from warpjld.motion.out import check_motion_out

    began = time.perf_counter()
    reading = {**wanted.reading, "animation": job.animation}
    ahead = ReadAhead(wanted.rig, wanted.how, job.motion, reading)  # before NumPy is imported
    try:
        if wanted.out is not None:  # suffix and libraries, before anything is waited for
            check_cache(wanted.out)
        for path in wanted.motions_out:
            check_motion_out(path)
        from warpjld.batch.deform_file import deform_file

        rig = opened_rig(wanted, ahead.rig)
        with progress(wanted.quiet) as report:
            made = deform_file(
                rig,
                job.motion,
                wanted.out,
                motion_out=wanted.motions_out,
                parameters=checked_parameters(wanted, rig),
                binding=wanted.binding,
                domains=wanted.domains,
                method=wanted.method,
                touch=wanted.touch,
                frames=wanted.span,
                device=wanted.device,
                threads=wanted.threads,
                report=report,
                moved=ahead.motion(),
                **reading,
            )
    finally:
        ahead.end()
    warn(made.warnings)
    summary = {
        "rig": wanted.rig,
        "motion": str(job.motion),
        "files": [str(file) for file in made.files],
        "frames": made.frames,
        "first_frame": made.first,
        "rate": made.moved.rate,
        "joints": len(rig.skeleton),
        "vertices": len(rig.surface.weld),
        "triangles": len(rig.surface.source_faces),
        "seconds": round(time.perf_counter() - began, 3),
        "warnings": [*rig.suspicious, *made.warnings],
        "rig_notes": list(rig.notes),
        "notes": [*made.moved.notes, *made.notes],
    }
    if wanted.as_json:
        answer(summary)
    elif not wanted.quiet:
        _tell(summary)
        tell_rig(wanted, rig)


def _tell(summary: dict[str, Any]) -> None:
    files, frames = summary["files"], summary["frames"]
    more = f" … {files[-1]} ({len(files)} files)" if len(files) > 1 else ""
    click.echo(f"{files[0]}{more}")
    click.echo(
        f"{count(frames, 'frame')} at {summary['rate']:g} a second, {summary['vertices']} vertices, "
        f"{summary['triangles']} triangles, {summary['joints']} joints; {summary['seconds']} s"
    )
    for note in summary["notes"]:
        click.echo(f"note: {note}")
