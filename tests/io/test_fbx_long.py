"""Long animations of FBX files are evaluated in processes of a few hundred frames each: ufbx's binding keeps memory
of every frame."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tests.io.test_fbx import chain
from warpjld.io.fbx import extract
from warpjld.motion.fbx_animation import read_fbx_animation

pytest.importorskip("ufbx", reason="needs ufbx")


def test_all_frames_of_several_processes_are_there_in_their_order(tmp_path: Path) -> None:
    fbx, count = chain(), 2 * extract._TOGETHER + 3
    worlds = np.tile(fbx.frames, (count, 1, 1, 1))
    worlds[:, :, 0, 3] += 0.001 * np.arange(count)[:, None]
    fbx.stacks["x"] = worlds
    read = read_fbx_animation(fbx.write(tmp_path / "x.fbx"))
    together = np.concatenate([block.worlds for _, block in read.blocks()])
    np.testing.assert_allclose(together[..., :3, 3], worlds[..., :3, 3], atol=1e-5)


def test_memory_that_ufbx_does_not_get_is_no_fault_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import ufbx

    def refuses(path: str, **options: object) -> None:
        raise ufbx.UfbxError("Out of memory: result")  # what it says within a limit on the address space

    monkeypatch.setattr(ufbx, "load_file", refuses)
    with pytest.raises(MemoryError):
        extract.load(tmp_path / "x.fbx")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
def test_what_goes_wrong_in_one_of_them_is_told(tmp_path: Path) -> None:
    def raises(error: BaseException) -> None:
        raise error

    with pytest.raises(MemoryError):
        extract.forked(lambda: raises(MemoryError()))
    with pytest.raises(RuntimeError, match="ends with code 1"):
        extract.forked(lambda: raises(ValueError()))
    with pytest.raises(RuntimeError, match="ends with code -9"):
        extract.forked(lambda: os.kill(os.getpid(), 9))
