"""Records of finished clips: status, and hashes of inputs and outputs."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.manifest import file_hash, write_json
from warpjld.files.text_file import read_json
from warpjld.io.identity import content_hash

__all__ = ["FOLDER", "ClipRecord", "read_record", "still_there", "write_record"]

FOLDER = ".clips"
"""Folder of the records, in the output folder."""


@dataclass(frozen=True)
class ClipRecord:
    """Result of a clip.

    Attributes:
        name: Name of the clip.
        motion: Path of the motion file, as given.
        motion_sha256: Its hash, see ``content_hash``; "" if it could not be read.
        animation: Name of the animation used, or None.
        status: ``done``, ``failed`` or ``crashed``.
        message: Reason of a failure.
        frames: Number of frames made.
        rate: Frames a second.
        files: Hashes of the files made, by name in the output folder.
        warnings: What of the motion the rig does not follow, and what looks wrong.
        notes: Further information for the user.
    """

    name: str
    motion: str
    motion_sha256: str
    animation: str | None
    status: str
    message: str = ""
    frames: int = 0
    rate: float = 0.0
    files: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def content(self) -> dict[str, Any]:
        """The record as plain values, for JSON."""
        return asdict(self)


def write_record(out: Path, record: ClipRecord) -> None:
    """Write a record to the output folder, atomically."""
    (out / FOLDER).mkdir(parents=True, exist_ok=True)
    write_json(out / FOLDER / f"{record.name}.json", record.content())


def read_record(out: Path, name: str) -> ClipRecord | None:
    """A clip's record; None if there is none that can be read."""
    try:
        record = ClipRecord(**read_json(out / FOLDER / f"{name}.json"))
    except (InputError, TypeError):
        return None
    return record if _is_sound(record) else None


def _is_sound(record: ClipRecord) -> bool:
    """Whether all values of a record have the expected types, and its names are valid file names."""
    texts: list[object] = [record.name, record.motion, record.motion_sha256, record.status, record.message]
    lists: tuple[object, ...] = (record.warnings, record.notes)
    if not all(isinstance(one, list) for one in lists) or not isinstance(record.files, dict):
        return False
    texts += [*record.warnings, *record.notes, *record.files, *record.files.values(), record.animation or ""]
    numbers: tuple[object, ...] = (record.frames, record.rate)
    return all(isinstance(one, str) and "\0" not in one for one in texts) and all(
        isinstance(one, int | float) for one in numbers
    )


def still_there(out: Path, record: ClipRecord) -> bool:
    """Whether a clip is done, and its inputs and outputs are unchanged."""
    try:
        return (
            record.status == "done"
            and content_hash(Path(record.motion)) == record.motion_sha256
            and all(file_hash(out / name) == value for name, value in record.files.items())
        )
    except OSError:
        return False
