"""Workers that are given up: ended at once, what they were writing removed."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from warpjld.files.whole_file import whole_file
from warpjld.runtime import processes
from warpjld.runtime.processes import run_jobs


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
        while not list(tmp_path.glob(".600.part*")) and time.monotonic() - began < 100.0:
            time.sleep(0.01)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(Sleep(tmp_path), [0, 600], processes=2, done=interrupted)
    assert time.monotonic() - began < 120.0
    assert not multiprocessing.active_children()
    assert [path.name for path in tmp_path.iterdir()] == ["0.txt"]


@dataclass(frozen=True)
class Deadly(Sleep):
    """Job 1 ends its process; others go on whatever they are told, once."""

    def do(self, job: int) -> str:
        """Wait for one another, then end the process or ignore that it should end."""
        first = not (self.folder / f"{job}.began").exists()
        (self.folder / f"{job}.began").touch()
        if job == 1:
            while not (self.folder / "0.began").exists():
                time.sleep(0.01)
            os._exit(9)
        until = time.monotonic() + 600.0 * first
        while time.monotonic() < until:
            try:
                time.sleep(0.1)
            except SystemExit:
                continue
        return "done"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_workers_that_do_not_heed_being_ended_are_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "_PATIENCE", 0.5)
    statuses = {}
    began = time.monotonic()
    run_jobs(Deadly(tmp_path), [0, 1], processes=2, done=statuses.__setitem__)
    assert statuses == {0: "done", 1: "crashed"}
    assert time.monotonic() - began < 120.0
    assert not multiprocessing.active_children()


def test_a_worker_started_while_others_are_ended_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pool's own thread ends workers as soon as one dies, and misses one that is started at that moment."""
    from multiprocessing.process import BaseProcess

    kill = BaseProcess.terminate

    def missed(process: BaseProcess) -> None:
        if threading.current_thread() is threading.main_thread():
            kill(process)

    monkeypatch.setattr(BaseProcess, "terminate", missed)
    monkeypatch.setattr(processes, "_PATIENCE", 0.5)
    statuses = {}
    run_jobs(Deadly(tmp_path), [0, 1], processes=2, done=statuses.__setitem__)
    assert statuses == {0: "done", 1: "crashed"}
