"""What is kept of a finished clip: how it ended, and the hashes of what it was made of and of what was made."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from warpjld.files.manifest import file_hash, write_json
from warpjld.io.identity import content_hash

__all__ = ["FOLDER", "ClipRecord", "read_record", "still_there", "write_record"]

FOLDER = ".clips"
"""Where records are kept, in the output folder."""


@dataclass(frozen=True)
class ClipRecord:
    """How a clip ended.

    Attributes:
        name: The clip's.
        motion: The motion file, as it was given.
        motion_sha256: Its hash, see ``content_hash``; "" where it could not be read.
        animation: The animation taken of it, or None.
        status: ``done``, ``failed`` or ``crashed``.
        message: Why it failed.
        frames: Frames made.
        rate: Frames a second.
        files: Files made, by name in the output folder, with their hashes.
        warnings: What of the motion the rig does not follow, and what looks wrong.
        notes: What else a reader of the result should know.
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
        """As plain values."""
        return asdict(self)


def write_record(out: Path, record: ClipRecord) -> None:
    """Keep a record in the output folder, whole or not at all."""
    (out / FOLDER).mkdir(parents=True, exist_ok=True)
    write_json(out / FOLDER / f"{record.name}.json", record.content())


def read_record(out: Path, name: str) -> ClipRecord | None:
    """A clip's record; None where there is none, or none that can be read."""
    try:
        return ClipRecord(**json.loads((out / FOLDER / f"{name}.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def still_there(out: Path, record: ClipRecord) -> bool:
    """Whether a clip is done and all that it was made of and all that it made are as they were."""
    try:
        return (
            record.status == "done"
            and content_hash(Path(record.motion)) == record.motion_sha256
            and all(file_hash(out / name) == value for name, value in record.files.items())
        )
    except OSError:
        return False
