"""``warpjld deform``: a rig moved by motion files, its surface written as vertex caches."""

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

__all__ = ["command"]


@click.command("deform")
@click.argument("rig")
@click.argument("clips", nargs=-1, type=click.Path(path_type=Path), metavar="[MOTION]...")
@click.option("--motion", "motions", multiple=True, type=click.Path(path_type=Path), help="A motion, likewise.")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    help=f"Cache to write ({', '.join(FORMATS)}); of a batch the folder to write into.",
)
@click.option(
    "--motion-out",
    "motions_out",
    multiple=True,
    type=click.Path(path_type=Path),
    help=f"Motion of RIG's own joints to write ({', '.join(MOTION_OUT)}); repeatable.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice([suffix.lstrip(".") for suffix in FORMATS]),
    help="Make a batch: every motion becomes a cache of this format in the folder --out; repeatable.",
)
@click.option(
    "--motion-format",
    "motion_formats",
    multiple=True,
    type=click.Choice([suffix.lstrip(".") for suffix in MOTION_OUT]),
    help="Likewise: the motion of RIG's own joints, as NAME.motion.bvh; repeatable.",
)
@options.rig
@click.option("--animation", help="Which animation of the motion file, by name, or all; the first by default.")
@click.option("--motion-side", type=click.Choice(["left", "right"]), help="Which hand a recording is of.")
@click.option(
    "--flat-hand-mean/--no-flat-hand-mean",
    default=None,
    help="Whether no rotation in MANO poses is the flat hand, or MANO's mean pose, where the file does not say.",
)
@click.option("--frames", "span", metavar="A:B", help="Only frames A to B, both included, the motion's first being 0.")
@click.option("--rate", type=float, help="Frames a second; the motion's own by default, 30 for CSV.")
@click.option(
    "--limits",
    type=click.Choice(["error", "clamp", "ignore"]),
    default="error",
    show_default=True,
    help="CSV angles beyond a joint's limit.",
)
@options.parameters
@click.option("--binding", type=click.Path(path_type=Path), help="Binding of RIG, as bind writes it.")
@options.domains
@click.option(
    "--method",
    type=click.Choice(["smooth", "paper"]),
    default="smooth",
    show_default=True,
    help="Soft domain borders, or one segment a vertex as published.",
)
@click.option(
    "--touch",
    type=click.Choice(["off", "on", "limit"]),
    default="off",
    show_default=True,
    help="Part skin that crosses (a display of contact); limit: close digits only until they touch.",
)
@click.option("--processes", type=click.IntRange(min=1), help="Worker processes of a batch; one a core by default.")
@click.option("--fresh", is_flag=True, help="Make a batch again from its start, whatever the folder holds of it.")
@options.device
@options.threads
@options.json
@options.quiet
def command(rig: str, clips: tuple[Path, ...], motions: tuple[Path, ...], **given: Any) -> None:
    """Deform RIG by MOTION files and write the surface, frame after frame, in the vertex order of RIG's file, or the
    motion of its joints.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd), a surface with --skeleton, or builtin:left or builtin:right for
    the built-in hand. A MOTION is .bvh, .csv, a file with animations (.glb, .gltf, .vrma, .fbx, .usd) or a recording
    of hands (.json, .npz, .npy). With --format or --motion-format (and
    with more than one clip) it is a batch: RIG is bound once, clips are made in several processes, a clip that fails
    does not end the others, and the same command goes on where it was stopped. manifest.json lists what was made of
    what.
    """
    from warpjld.batch import clip_jobs

    jobs = clip_jobs([*motions, *clips], given["animation"])
    if not jobs:
        raise InputError("deform: want a motion file behind RIG")
    how = {name: given.pop(name) for name in options.RIG}
    for name in ("formats", "motion_formats"):
        given[name] = tuple(f".{suffix}" for suffix in dict.fromkeys(given[name]))
    wanted = Wanted(rig, how, **given)
    batch = bool(wanted.formats or wanted.motion_formats)
    if len(jobs) > 1 and not batch:
        raise InputError(f"{len(jobs)} clips: say by --format what each is to become, in the folder --out")
    if batch and wanted.motions_out:
        raise InputError("--motion-out names one file: a batch takes --motion-format")
    if wanted.out is None and (batch or not wanted.motions_out):
        raise InputError(f"deform: want --out, the {'folder' if batch else 'file'} to write")
    check_outputs(wanted.outputs(jobs), wanted.inputs(jobs))
    if batch:
        from warpjld.cli.deform_batch import make_batch

        make_batch(wanted, jobs)
    else:
        _single(wanted, jobs[0])


def _single(wanted: Wanted, job: ClipJob) -> None:
    from warpjld.batch.deform_file import deform_file
    from warpjld.cli.deform_wanted import checked_parameters, opened_rig
    from warpjld.cli.progress import progress
    from warpjld.io.caches import check_cache
    from warpjld.motion.out import check_motion_out

    began = time.perf_counter()
    if wanted.out is not None:  # an unknown suffix or a missing library must not cost the work of reading the rig
        check_cache(wanted.out)
    for path in wanted.motions_out:
        check_motion_out(path)
    rig = opened_rig(wanted)
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
            animation=job.animation,
            frames=wanted.span,
            device=wanted.device,
            threads=wanted.threads,
            report=report,
            **wanted.reading,
        )
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
