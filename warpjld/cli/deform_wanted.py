"""Options of ``warpjld deform`` other than the motions, and the rig, parameters and files that they name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

if TYPE_CHECKING:
    from warpjld.batch import ClipJob, Deforming
    from warpjld.covering import Parameters
    from warpjld.rig import Rig

__all__ = ["Wanted", "checked_parameters", "count", "deforming", "opened_rig", "tell_rig"]


@dataclass(frozen=True)
class Wanted:
    """Options of the command line other than the motions."""

    rig: str
    how: dict[str, Any]
    formats: tuple[str, ...]
    motion_formats: tuple[str, ...]
    motions_out: tuple[Path, ...]
    out: Path | None
    animation: str | None
    motion_side: str | None
    flat_hand_mean: bool | None
    span: str | None
    rate: float | None
    limits: str
    parameters: Path | None
    binding: Path | None
    domains: Literal["geometry", "skin"]
    method: Literal["smooth", "paper"]
    touch: Literal["off", "on", "limit"]
    processes: int | None
    fresh: bool
    device: str
    threads: int | None
    as_json: bool
    quiet: bool

    @property
    def reading(self) -> dict[str, Any]:
        """Keyword arguments for reading motions."""
        return {
            "rate": self.rate,
            "limits": self.limits,
            "side": self.motion_side,
            "flat_hand_mean": self.flat_hand_mean,
        }

    def inputs(self, jobs: list[ClipJob]) -> list[Path]:
        """All files that are read."""
        from warpjld.cli.rig_argument import rig_files
        from warpjld.io.identity import files_of

        motions = dict.fromkeys(job.motion for job in jobs)
        motion_files = [file for motion in motions for file in (motion, *files_of(motion))]
        return [
            *rig_files(self.rig, self.how | {"parameters": self.parameters, "binding": self.binding}),
            *motion_files,
        ]

    def outputs(self, jobs: list[ClipJob]) -> list[Path]:
        """Files that are written, without companion files of a cache."""
        if not (self.formats or self.motion_formats):
            return [path for path in (self.out, *self.motions_out) if path is not None]
        assert self.out is not None
        ends = [*self.formats, *(f".motion{suffix}" for suffix in self.motion_formats)]
        return [self.out / f"{job.name}{end}" for job in jobs for end in ends]

    def settings(self) -> dict[str, Any]:
        """Everything besides the motions that determines the files of a batch."""
        from warpjld.files.manifest import versions
        from warpjld.io.identity import content_hash

        files = {"rig": Path(self.rig), "parameters": self.parameters} | {
            name: value for name, value in self.how.items() if isinstance(value, Path)
        }
        hashes = {name: content_hash(path) for name, path in files.items() if path is not None and path.is_file()}
        plain = {name: value for name, value in self.how.items() if not isinstance(value, Path)}
        return {
            "rig": hashes.pop("rig", self.rig),
            **hashes,
            **plain,
            **{f"motion_{name}": value for name, value in self.reading.items()},
            "frames": self.span,
            "formats": [*self.formats, *(f".motion{suffix}" for suffix in self.motion_formats)],
            "domains": self.domains,
            "method": self.method,
            "touch": self.touch,
            "device": self.device,
            "warpjld": versions(["warpjld"])["warpjld"],
        }


def opened_rig(wanted: Wanted, ahead: Callable[[], Rig | None] = lambda: None) -> Rig:
    """Open the rig, or take it from ``ahead`` where it was read already; suspicious findings are printed on stderr."""
    from warpjld.cli.rig_argument import open_rig
    from warpjld.cli.warn import warn
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    rig = ahead()
    if rig is None:
        return open_rig(wanted.rig, **wanted.how)
    warn(rig.suspicious, "suspicious")
    return rig


def checked_parameters(wanted: Wanted, rig: Rig) -> Parameters | None:
    """The covering's parameters; None for the defaults."""
    from warpjld.covering import load_parameters

    return None if wanted.parameters is None else load_parameters(wanted.parameters, rig.skeleton)


def deforming(wanted: Wanted) -> Deforming:
    """The rig and the settings that all clips of a batch share."""
    from warpjld.batch import Deforming

    rig = opened_rig(wanted)
    return Deforming(
        rig,
        checked_parameters(wanted, rig),
        wanted.domains,
        wanted.method,
        wanted.reading,
        wanted.span,
        wanted.device,
        wanted.threads,
        wanted.touch,
        wanted.binding,
    )


def tell_rig(wanted: Wanted, rig: Rig) -> None:
    """Say how to see the notes on the rig, if there are any."""
    count = len(rig.notes)
    if count:
        click.echo(f"note: warpjld inspect {wanted.rig} shows {count} notes on what was recognised and repaired")


def count(number: int, what: str) -> str:
    """``3 frames``, ``1 frame``."""
    return f"{number} {what}{'s' * (number != 1)}"
