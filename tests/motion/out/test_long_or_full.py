"""Motions longer than memory, and disks that are full."""

from __future__ import annotations

import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from tests.motion.skeletons import hand, rig
from warpjld.errors import InputError
from warpjld.motion.out import MOTION_OUT, write_motion
from warpjld.motion.out.mano import hand_parameters
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.streamed_poses import streamed_rows


def _waving(count: int) -> Poses:
    skeleton = hand("left")

    def some(frames: slice) -> Poses:
        angles = np.zeros((frames.stop - frames.start, len(skeleton), 4))
        angles[..., 0] = np.sin(0.1 * np.arange(frames.start, frames.stop))[:, None]
        return poses_from_angles(skeleton, angles)

    return streamed_rows(count, some)


def test_mano_parameters_do_not_stay_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("files.spilled_rows._IN_MEMORY", 1000), ("files.spilled_rows._BLOCK", 64)):
        monkeypatch.setattr(f"warpjld.{name}", value)
    monkeypatch.setattr("warpjld.skeleton.streamed_poses.BLOCK", 64)
    owner, most = rig(hand("left")), []
    for count in (128, 128, 1280):
        poses = _waving(count)
        tracemalloc.start()
        write_motion(tmp_path / "m.npz", owner, poses, rate=30.0)
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert most[2] - most[1] < 50_000  # bytes; the parameters of the frames that were added are 470,000
    with np.load(tmp_path / "m.npz") as read:
        for name, array in hand_parameters(owner.skeleton, poses[640:650], "left").items():
            np.testing.assert_array_equal(read[name][640:650], array)
            assert len(read[name]) == 1280


@pytest.mark.skipif(sys.platform != "linux", reason="sizes of files are limited as Linux does it")
@pytest.mark.parametrize("suffix", MOTION_OUT)
def test_a_full_disk_is_one_line_and_the_old_file_stays(tmp_path: Path, suffix: str) -> None:
    if suffix.startswith(".usd"):
        pytest.importorskip("pxr")
    import resource

    path, owner = tmp_path / f"a{suffix}", rig(hand("left"))
    path.write_bytes(b"the old one")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(InputError) as error:
            write_motion(path, owner, _waving(250), rate=30.0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(error.value).startswith(f"{path}: cannot be written: ")
    assert len(str(error.value).splitlines()) == 1
    assert path.read_bytes() == b"the old one"
    assert list(tmp_path.iterdir()) == [path]
