"""Work of a batch's worker process: one clip at a time, recorded when its files are complete."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from pathlib import Path

from warpjld.batch.clips import ClipJob
from warpjld.batch.deform import Deforming, deform_clip
from warpjld.batch.record import ClipRecord, read_record, write_record
from warpjld.errors import WarpjldError
from warpjld.files.manifest import file_hash
from warpjld.io.identity import content_hash

__all__ = ["BatchWork"]


@dataclass(frozen=True, eq=False)
class BatchWork:
    """Clips of a bound rig, written into a folder.

    Attributes:
        how: The rig and the settings.
        out: The output folder.
        formats: Suffixes of the vertex caches to write for every clip.
        motion_formats: Suffixes of joint motion files to write for every clip.
    """

    how: Deforming
    out: Path
    formats: tuple[str, ...]
    motion_formats: tuple[str, ...] = ()

    def begin(self) -> None:
        """Suppress Warp's messages in the output of workers."""
        from warpjld.runtime.quiet import silence_warp

        silence_warp()

    def do(self, job: ClipJob) -> str:
        """Make a clip; returns its status. Errors are recorded and do not affect other clips."""
        hashed = ""
        try:
            hashed = content_hash(job.motion)
            made = deform_clip(
                self.how,
                job.motion,
                animation=job.animation,
                surfaces=tuple(self.out / f"{job.name}{suffix}" for suffix in self.formats),
                motions=tuple(self.out / f"{job.name}.motion{suffix}" for suffix in self.motion_formats),
            )
            record = ClipRecord(
                job.name,
                str(job.motion),
                hashed,
                job.animation,
                "done",
                frames=made.frames,
                rate=made.moved.rate,
                files={file.relative_to(self.out).as_posix(): file_hash(file) for file in made.files},
                warnings=list(made.warnings),
                notes=[*made.moved.notes, *made.notes],
            )
        except OSError as error:
            record = self._failed(job, hashed, f"{error.filename or job.motion}: {error.strerror or error}")
        except WarpjldError as error:
            record = self._failed(job, hashed, str(error))
        except Exception as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(place.filename).name}:{place.lineno}"
            record = self._failed(job, hashed, f"{job.motion}: {type(error).__name__}: {error} ({where})")
        write_record(self.out, record)
        return record.status

    def kept(self, job: ClipJob) -> str | None:
        """Status of a clip that was made in this run already, else None."""
        record = read_record(self.out, job.name)
        return None if record is None else record.status

    def bury(self, job: ClipJob) -> str:
        """Record that a clip crashed its process; returns its status."""
        write_record(self.out, self._failed(job, "", f"{job.motion}: the clip ended its process", "crashed"))
        return "crashed"

    def _failed(self, job: ClipJob, hashed: str, message: str, status: str = "failed") -> ClipRecord:
        return ClipRecord(job.name, str(job.motion), hashed, job.animation, status, message)
