"""``warpjld deform`` for a batch of clips: bound once, several processes, a manifest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from warpjld.cli.answer import answer
from warpjld.cli.deform_wanted import Wanted, count, deforming, tell_rig
from warpjld.cli.warn import warn

if TYPE_CHECKING:
    from warpjld.batch import ClipJob, ClipRecord

__all__ = ["make_batch"]


def make_batch(wanted: Wanted, jobs: list[ClipJob]) -> None:
    from warpjld.batch import run_batch
    from warpjld.cli.progress import progress
    from warpjld.io.caches import check_cache
    from warpjld.motion.out import check_motion_out

    assert wanted.out is not None
    for suffix in wanted.formats:
        check_cache(f"clip{suffix}")
    for suffix in wanted.motion_formats:
        check_motion_out(f"clip{suffix}")
    settings = wanted.settings()
    how = deforming(replace(wanted, threads=wanted.threads or 1))
    with progress(wanted.quiet) as report:
        try:
            result = run_batch(
                how,
                jobs,
                wanted.out,
                wanted.formats,
                settings,
                motion_formats=wanted.motion_formats,
                processes=wanted.processes,
                fresh=wanted.fresh,
                report=report,
                ended=lambda record: _tell_clip(record, wanted.quiet or wanted.as_json),
            )
        except KeyboardInterrupt:
            click.echo(f"stopped; the same command continues from what is in {wanted.out}", err=True)
            raise
    frames = sum(clip.frames for clip in result.clips)
    if wanted.as_json:
        answer(
            {
                "rig": wanted.rig,
                "manifest": str(result.manifest),
                "clips": [clip.content() for clip in result.clips],
                "made": result.made,
                "failed": result.failed,
                "frames": frames,
                "seconds": round(result.seconds, 3),
                "warnings": list(how.rig.suspicious),
                "rig_notes": list(how.rig.notes),
            }
        )
    elif not wanted.quiet:
        tell_rig(wanted, how.rig)
        there = len(result.clips) - result.made
        click.echo(
            f"{count(len(result.clips), 'clip')}, {count(frames, 'frame')}: "
            f"{result.made - result.failed} made in {result.seconds:.1f} s"
            f"{f', {there} there already' if there else ''}"
            f"{f', {result.failed} failed' if result.failed else ''}; {result.manifest}"
        )
    if result.failed:
        raise SystemExit(1)


def _tell_clip(clip: ClipRecord, quiet: bool) -> None:
    warn(f"{clip.name}: {warning}" for warning in clip.warnings)
    if clip.status != "done":
        warn([f"{clip.name}: {clip.message}"], clip.status)
    elif not quiet:
        click.echo(
            f"{clip.name}: {count(clip.frames, 'frame')} at {clip.rate:g} a second → {', '.join(_few(clip.files))}"
        )


def _few(files: dict[str, str]) -> list[str]:
    names = list(files)
    return names if len(names) < 4 else [names[0], "…", f"{names[-1]} ({len(names)} files)"]
