"""Running of a batch, from the start or from where it was stopped, and its manifest."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from warpjld.batch.clips import ClipJob
from warpjld.batch.deform import Deforming
from warpjld.batch.record import FOLDER, ClipRecord, read_record, still_there
from warpjld.batch.work import BatchWork
from warpjld.errors import InputError
from warpjld.files.folder_lock import locked_folder
from warpjld.files.folders import make_folder
from warpjld.files.manifest import fingerprint, write_json
from warpjld.runtime.processes import run_jobs
from warpjld.runtime.threads import cores

__all__ = ["BatchResult", "run_batch"]

_MANIFEST = "manifest.json"
_SETTINGS = ".settings.json"  # clips never have this name
_LOCK = ".lock"


@dataclass(frozen=True, eq=False)
class BatchResult:
    """Result of a batch.

    Attributes:
        clips: Records of all clips, in the order given.
        manifest: File with all records and settings.
        made: Number of clips made in this run; others existed already.
        seconds: Wall-clock time.
    """

    clips: tuple[ClipRecord, ...]
    manifest: Path
    made: int
    seconds: float

    @property
    def failed(self) -> int:
        """Number of clips that could not be made."""
        return sum(clip.status != "done" for clip in self.clips)


def run_batch(
    how: Deforming,
    jobs: Sequence[ClipJob],
    out: Path,
    formats: tuple[str, ...],
    settings: dict[str, Any],
    *,
    motion_formats: tuple[str, ...] = (),
    processes: int | None = None,
    fresh: bool = False,
    report: Callable[[str, int, int], None] = lambda what, done, total: None,
    ended: Callable[[ClipRecord], None] = lambda record: None,
) -> BatchResult:
    """Make the missing clips of a batch, then write its manifest.

    A clip is not made again if its record says that it is done and neither its motion file nor its output files have
    changed since. Files and manifest depend on the rig, the motions and the settings only, not on the number of
    processes, nor on interruptions.

    Args:
        how: The bound rig and the settings.
        jobs: The clips.
        out: Output folder.
        formats: Suffixes of the vertex caches to write for every clip.
        settings: Everything besides the motions that determines the files, as JSON: settings, hashes of rig files.
        motion_formats: Suffixes of joint motion files to write for every clip, as ``<clip>.motion.bvh``.
        processes: Number of worker processes; as many as the machine has cores by default.
        fresh: Whether to discard the records of another batch in ``out``.
        report: Called with the current activity, the amount done, and the total.
        ended: Called with the record of every finished clip.

    Raises:
        InputError: ``out`` holds a batch with other settings, is in use by another process, or cannot be written.
    """
    began = time.perf_counter()
    _make(out)
    with locked_folder(out, f"{FOLDER}/{_LOCK}"):
        _open(out, settings, fresh)
        records, made = _made(how, jobs, out, formats, motion_formats, processes, report, ended)
        write_json(
            out / _MANIFEST,
            {"fingerprint": fingerprint(settings), "settings": settings, "clips": [r.content() for r in records]},
        )
    return BatchResult(tuple(records), out / _MANIFEST, made, time.perf_counter() - began)


def _made(
    how: Deforming,
    jobs: Sequence[ClipJob],
    out: Path,
    formats: tuple[str, ...],
    motion_formats: tuple[str, ...],
    processes: int | None,
    report: Callable[[str, int, int], None],
    ended: Callable[[ClipRecord], None],
) -> tuple[list[ClipRecord], int]:
    """Make the missing clips; returns the records of all clips, and the number of clips made now."""
    waiting = [job for job in jobs if (kept := read_record(out, job.name)) is None or not _same(out, job, kept)]
    for job in waiting:
        _forget(out, job)
    count = len(jobs) - len(waiting)
    report("clips", count, len(jobs))

    def done(job: ClipJob, status: str) -> None:
        nonlocal count
        count += 1
        report("clips", count, len(jobs))
        record = read_record(out, job.name)
        if record is not None:
            ended(record)

    if waiting:
        if formats:
            report("binding", count, len(jobs))
            _ = how.covering.runs  # bind once here, not in every worker
        workers = min(processes or cores(), len(waiting))
        run_jobs(BatchWork(how, out, formats, motion_formats), waiting, processes=workers, done=done)
    return [record for job in jobs if (record := read_record(out, job.name)) is not None], len(waiting)


def _same(out: Path, job: ClipJob, record: ClipRecord) -> bool:
    return (record.motion, record.animation) == (str(job.motion), job.animation) and still_there(out, record)


def _make(out: Path) -> None:
    make_folder(out)
    make_folder(out / FOLDER)
    try:
        (out / FOLDER / _LOCK).open("a").close()
    except OSError as error:
        raise InputError(f"cannot write into this folder: {error.strerror}", path=out) from None


def _open(out: Path, settings: dict[str, Any], fresh: bool) -> None:
    """Check that the content of the folder was made with these settings."""
    known = out / FOLDER / _SETTINGS
    try:
        for record in (out / FOLDER).glob("*.json") if fresh else ():
            record.unlink()
        if known.exists():
            before = json.loads(known.read_text(encoding="utf-8"))
            plain = json.loads(json.dumps(settings, ensure_ascii=False))
            names = [name for name in {**before, **plain} if before.get(name) != plain.get(name)]
            if names:
                raise InputError(
                    f"holds clips made with other settings ({', '.join(names)}); choose another folder, or --fresh "
                    "to make them again",
                    path=out,
                )
        write_json(known, settings)
    except (OSError, ValueError, AttributeError) as error:
        raise InputError(f"cannot be used as the batch's folder: {error}", path=out) from error


def _forget(out: Path, job: ClipJob) -> None:
    """Remove a clip's record before it is made again."""
    (out / FOLDER / f"{job.name}.json").unlink(missing_ok=True)
