"""``warpjld deform``: a rig moved by a motion file, its surface written as a vertex cache."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from warpjld.cli import options
from warpjld.cli.answer import answer
from warpjld.cli.warn import warn
from warpjld.errors import InputError
from warpjld.io.caches import FORMATS

__all__ = ["command"]

_BLOCK = 16  # frames deformed at once: memory does not grow with the length of the motion


@click.command("deform")
@click.argument("rig")
@click.option("--motion", required=True, type=click.Path(path_type=Path), help="Motion: CSV, BVH, glTF/GLB, JSON.")
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help=f"Cache to write: {', '.join(FORMATS)}.",
)
@options.rig
@click.option("--frames", "span", metavar="A:B", help="Only frames A to B, both included, the motion's first being 0.")
@click.option("--rate", type=float, help="Frames a second; the motion's own by default, 30 for CSV.")
@click.option(
    "--limits",
    type=click.Choice(["error", "clamp", "ignore"]),
    default="error",
    show_default=True,
    help="CSV angles beyond a joint's limit.",
)
@click.option("--parameters", type=click.Path(path_type=Path), help="Covering parameters, as calibrate writes them.")
@options.domains
@click.option(
    "--method",
    type=click.Choice(["smooth", "paper"]),
    default="smooth",
    show_default=True,
    help="Soft domain borders, or one segment a vertex as published.",
)
@options.device
@options.threads
@options.json
@options.quiet
def command(
    rig: str,
    motion: Path,
    out: Path,
    span: str | None,
    rate: float | None,
    limits: str,
    parameters: Path | None,
    domains: str,
    method: str,
    device: str,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Deform RIG by a motion and write the surface, frame after frame, in the vertex order of RIG's file.

    RIG is a rig file, or builtin:left or builtin:right for the built-in hand.
    """
    from warpjld.cli.progress import progress
    from warpjld.cli.rig_argument import open_rig
    from warpjld.covering import bind_rig, load_parameters
    from warpjld.io.caches import open_cache
    from warpjld.motion import open_motion
    from warpjld.quiet import silence_warp

    silence_warp()
    began = time.perf_counter()
    driven = open_rig(rig, **how)
    moved = open_motion(motion, driven, rate=rate, limits=limits)  # type: ignore[arg-type]
    warn(moved.warnings)
    first, last = _span(span, len(moved.poses))
    poses = moved.poses[slice(first, last + 1)]
    chosen = None if parameters is None else load_parameters(parameters, driven.skeleton)
    # opened first: an unknown suffix or a forbidden folder must not cost the work of binding
    writing = open_cache(out, driven.surface, frames=len(poses), rate=moved.rate, start_frame=first, name=driven.name)
    with progress(quiet) as report, writing as cache:
        report("binding", 0, len(poses))
        covering = bind_rig(
            driven,
            parameters=chosen,
            domains=domains,  # type: ignore[arg-type]
            method=method,  # type: ignore[arg-type]
        )
        for start, block in covering.blocks(poses, frames=_BLOCK, device=device, threads=threads):
            cache.write(block)
            report("deforming", start + len(block), len(poses))
    summary = {
        "rig": rig,
        "motion": str(motion),
        "files": [str(file) for file in cache.files],
        "frames": len(poses),
        "first_frame": first,
        "rate": moved.rate,
        "joints": len(driven.skeleton),
        "vertices": len(driven.surface.weld),
        "triangles": len(driven.surface.source_faces),
        "seconds": round(time.perf_counter() - began, 3),
        "warnings": [*driven.suspicious, *moved.warnings],
        "notes": [*moved.notes, *([cache.note] if cache.note else [])],
    }
    if as_json:
        answer(summary)
    elif not quiet:
        _tell(summary)


def _span(text: str | None, count: int) -> tuple[int, int]:
    """First and last frame of ``A:B``; either may be left out."""
    if text is None:
        return 0, count - 1
    left, colon, right = text.partition(":")
    try:
        first, last = int(left or 0), int(right) if right else (count - 1 if colon else int(left))
    except ValueError:
        raise InputError(f"--frames '{text}': want two frame numbers, such as 10:60") from None
    if not 0 <= first <= last < count:
        raise InputError(f"--frames '{text}': the motion has frames 0 to {count - 1}")
    return first, last


def _tell(summary: dict[str, Any]) -> None:
    files, frames = summary["files"], summary["frames"]
    more = f" … {files[-1]} ({len(files)} files)" if len(files) > 1 else ""
    click.echo(f"{files[0]}{more}")
    click.echo(
        f"{frames} frame{'s' * (frames != 1)} at {summary['rate']:g} a second, {summary['vertices']} vertices, "
        f"{summary['triangles']} triangles, {summary['joints']} joints; {summary['seconds']} s"
    )
    for note in summary["notes"]:
        click.echo(f"note: {note}")
