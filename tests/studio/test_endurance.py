"""Sliders dragged for long: how many updates a second the server makes, and that memory stays what it was."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from warpjld.studio.opening import opened_document
from warpjld.studio.room import Room

pytestmark = pytest.mark.slow


def resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is measured by /proc")
@pytest.mark.parametrize(("resolution", "updates", "rate"), [(8000, 10_000, 60), (20000, 500, 15)])
def test_updates_a_second_and_memory(tmp_path: Path, resolution: int, updates: int, rate: float) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    script = tmp_path / "a.jld"
    script.write_text(f"HAND LEFT BUILTIN RESOLUTION {resolution}\n")
    room = Room(opened_document(script, tmp_path / "out"), port=0)
    assert room.worker.settle(300)

    def drag(count: int) -> None:
        for k in range(count):
            room.post(lambda k=k: room.state.set_angles({"left.index.base.flexion": k % 90}, kind="drag"))
        assert room.worker.settle(3000)

    drag(updates // 5)
    before, began = resident(), time.process_time()
    drag(updates)
    spent = time.process_time() - began
    grown = resident() - before
    room.stop()
    print(f"{resolution} vertices: {updates / spent:.0f} updates a second of processor time, {grown / 1e6:+.1f} MB")
    assert grown < 30e6
    assert updates / spent > rate
