"""A batch of clips on a small rig: the same files as one by one, resumed, and not ended by a clip that fails."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.finger import finger
from warpjld.batch import BatchResult, Deforming, clip_jobs, deform_clip, run_batch
from warpjld.errors import InputError
from warpjld.files import whole_file
from warpjld.files.folder_lock import locked_folder
from warpjld.files.whole_file import part_of

SETTINGS = {"rig": "finger", "rate": None}


@pytest.fixture
def clips(tmp_path: Path) -> list[Path]:
    """Three curls, and a file that is none."""
    files = []
    for name, angle in (("little", 20), ("half", 45), ("whole", 80)):
        files.append(tmp_path / f"{name}.csv")
        files[-1].write_text(f"frame,index.base.flexion\n0,0\n12,{angle}\n")
    files.append(tmp_path / "broken.csv")
    files[-1].write_text("frame,index.base.flexion\n0,much\n")
    return files


def run(clips: list[Path], out: Path, **how: object) -> BatchResult:
    jobs = clip_jobs(clips)
    return run_batch(Deforming(finger(), threads=1), jobs, out, (".npz", ".pc2"), SETTINGS, **how)  # type: ignore[arg-type]


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_files_are_those_of_single_clips_whatever_the_number_of_processes(clips: list[Path], tmp_path: Path) -> None:
    ended: list[str] = []
    result = run(clips, tmp_path / "two", processes=2, ended=lambda record: ended.append(record.name))
    assert [clip.status for clip in result.clips] == ["done", "done", "done", "failed"]
    assert result.failed == 1
    assert "broken.csv:2:2" in result.clips[3].message
    assert sorted(ended) == ["broken", "half", "little", "whole"]
    run(clips, tmp_path / "one", processes=1)
    assert content(tmp_path / "one") == content(tmp_path / "two")
    for clip in clips[:3]:
        deform_clip(Deforming(finger()), clip, surfaces=(tmp_path / "single.npz",))
        with np.load(tmp_path / "single.npz") as single, np.load(tmp_path / "two" / f"{clip.stem}.npz") as batch:
            np.testing.assert_array_equal(batch["vertices"], single["vertices"])
    told = json.loads((tmp_path / "two" / "manifest.json").read_text())
    assert [clip["name"] for clip in told["clips"]] == ["little", "half", "whole", "broken"]
    assert set(told["clips"][0]["files"]) == {"little.npz", "little.pc2", "little.rest.obj"}


def test_a_resumed_batch_makes_what_is_missing_or_changed_and_nothing_else(clips: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(clips[:3], out, processes=1)
    before = content(out)
    stamps = {path.name: path.stat().st_mtime_ns for path in out.glob("*.npz")}
    (out / "half.npz").unlink()
    (out / "whole.pc2").write_bytes(b"damaged")
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    mine = part_of(out / "half.npz").name
    left = out / mine.replace(f"part{os.getpid()}", f"part{gone.stdout.strip()}")
    left.write_bytes(b"left by a killed worker")
    whole_file._swept.clear()
    again = run(clips[:3], out, processes=1)
    assert (again.made, again.failed) == (2, 0)
    assert content(out) == before
    assert (out / "little.npz").stat().st_mtime_ns == stamps["little.npz"]
    clips[0].write_text("frame,index.base.flexion\n0,0\n12,30\n")
    assert run(clips[:3], out, processes=1).made == 1
    assert content(out)["little.npz"] != before["little.npz"]
    assert run(clips[:3], out, processes=1).made == 0


def test_motions_alone_need_no_surface(clips: list[Path], tmp_path: Path) -> None:
    jobs, out = clip_jobs(clips[:2]), tmp_path / "out"
    result = run_batch(Deforming(finger(), threads=1), jobs, out, (), SETTINGS, motion_formats=(".bvh",), processes=1)
    assert [clip.files.keys() for clip in result.clips] == [{"little.motion.bvh"}, {"half.motion.bvh"}]
    assert "Frames: 13" in (out / "half.motion.bvh").read_text()


def test_another_batch_does_not_mix_with_it(clips: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(clips[:1], out, processes=1)
    other = SETTINGS | {"rate": 20}
    how = replace(Deforming(finger(), threads=1), reading={"rate": 20})
    with pytest.raises(InputError, match=r"other settings \(rate\); choose another folder, or --fresh"):
        run_batch(how, clip_jobs(clips[:1]), out, (".npz",), other)
    assert run_batch(how, clip_jobs(clips[:1]), out, (".npz",), other, fresh=True, processes=1).made == 1


def test_two_batches_at_once_do_not_write_into_one_folder(clips: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(clips[:1], out, processes=1)
    before = content(out)
    with (
        locked_folder(out, ".clips/.lock"),
        pytest.raises(InputError, match="out: another process is working in this folder"),
    ):
        run(clips[:2], out, fresh=True)
    assert content(out) == before
    assert run(clips[:2], out, processes=1).made == 1


def test_a_clip_that_kills_its_process_is_a_line(clips: list[Path], tmp_path: Path) -> None:
    jobs = clip_jobs(clips[:2])
    result = run_batch(_Deadly(finger(), threads=1), jobs, tmp_path / "out", (".npz",), SETTINGS, processes=2)
    assert [clip.status for clip in result.clips] == ["crashed", "done"]


class _Deadly(Deforming):
    """Ends the process where a motion is called little."""

    def __getattribute__(self, name: str) -> object:
        import inspect
        import os

        if name == "reading" and any("little" in str(f.frame.f_locals.get("motion")) for f in inspect.stack()[1:3]):
            os._exit(9)
        return super().__getattribute__(name)
