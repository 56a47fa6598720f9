"""Workers that are given up: ended at once, what they were writing removed."""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from warpjld.processes import run_jobs
from warpjld.whole_file import whole_file


@dataclass(frozen=True)
class Sleep:
    """Writes a file for as many seconds as the job says."""

    folder: Path

    def begin(self) -> None:
        """Nothing to begin."""

    def do(self, job: int) -> str:
        """Sleep with a file half written."""
        with whole_file(self.folder / f"{job}.txt") as part:
            part.write_text("half")
            time.sleep(job)
        return "done"

    def kept(self, job: int) -> str | None:
        """Nothing is kept."""
        return None

    def bury(self, job: int) -> str:
        """Nothing is kept."""
        return "crashed"


def test_an_interrupt_does_not_wait_for_jobs_and_leaves_no_half_of_a_file(tmp_path: Path) -> None:
    began = time.monotonic()

    def interrupted(job: int, status: str) -> None:
        while not (tmp_path / ".600.part.txt").exists():
            time.sleep(0.01)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(Sleep(tmp_path), [0, 600], processes=2, done=interrupted)
    assert time.monotonic() - began < 120.0
    assert not multiprocessing.active_children()
    assert [path.name for path in tmp_path.iterdir()] == ["0.txt"]
