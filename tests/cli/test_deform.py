"""``warpjld deform`` end to end on a small finger, and its refusals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.finger import finger
from warpjld.cli import main
from warpjld.errors import InputError

MOTION = "frame,index.base.flexion,index.knuckle2.flexion\n0,0,0\n20,60,90\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("warpjld.cli.rig_argument.open_rig", lambda text, **options: finger())
    monkeypatch.chdir(tmp_path)
    (tmp_path / "curl.csv").write_text(MOTION)
    return tmp_path


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["deform", *arguments])
    return int(ended.value.code or 0)


def test_writes_every_frame_and_says_so(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("finger.glb", "--motion", "curl.csv", "-o", "out/curl.npz", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["frames"], told["rate"], told["vertices"], told["files"]) == (21, 30, 338, ["out/curl.npz"])
    with np.load(place / "out" / "curl.npz") as cache:
        vertices = cache["vertices"]
        np.testing.assert_allclose(vertices[0], cache["rest"], atol=1e-7)
    assert vertices.shape == (21, 338, 3)
    # flexed by 60° and 90°, the fingertip points back at the wrist's side
    turn = np.radians(150)
    middle = np.array([0, -0.05 * np.sin(np.pi / 3), -0.05 * np.cos(np.pi / 3)])
    tip = middle + 0.05 * np.array([0, -np.sin(turn), -np.cos(turn)])
    np.testing.assert_allclose(vertices[-1, 337], tip, atol=2e-3)


def test_some_frames_at_another_rate(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("finger.glb", "--motion", "curl.csv", "-o", "all.npz", "-q")
    assert capsys.readouterr().out == ""
    assert run("finger.glb", "--motion", "curl.csv", "-o", "some.npz", "--frames", "5:9", "--rate", "50") == 0
    assert "5 frames at 50 a second, 338 vertices" in capsys.readouterr().out
    with np.load(place / "all.npz") as whole, np.load(place / "some.npz") as some:
        np.testing.assert_array_equal(some["vertices"], whole["vertices"][5:10])


def test_held_in_betweens_are_noted(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "curl.csv").write_text("frame,index.base.flexion\n0,0\n10,90\n20,89\n30,0\n")
    run("finger.glb", "--motion", "curl.csv", "-o", "curl.npz")
    assert "note: left.index.base.flexion: interpolated values from frame 11 to" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--motion", "curl.csv", "-o", "curl.xyz"), "unknown kind of cache '.xyz'"),
        (("--motion", "none.csv", "-o", "curl.npz"), "none.csv: cannot be read"),
        (("--motion", "curl.max", "-o", "curl.npz"), "unknown kind of motion '.max'"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--frames", "5:50"), "the motion has frames 0 to 20"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--frames", "a:b"), "want two frame numbers"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--rate", "0"), "rate: want frames a second"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--device", "abacus"), "abacus"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--domains", "skin"), "skin"),
        (("--motion", "curl.csv", "-o", "curl.npz", "--parameters", "none.json"), "none.json: cannot be read"),
    ],
)
def test_refusals_leave_nothing_behind(
    place: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    assert run("finger.glb", *arguments) == 1
    told = capsys.readouterr()
    assert message in told.err
    assert "Traceback" not in told.err
    assert told.out == ""
    assert [path.name for path in place.iterdir()] == ["curl.csv"]


def test_interrupted_work_leaves_nothing_behind(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from warpjld.covering import Covering

    def interrupted(*_: object, **__: object) -> object:
        yield 0, np.zeros((16, 338, 3), dtype=np.float32)
        raise KeyboardInterrupt

    monkeypatch.setattr(Covering, "blocks", interrupted)
    assert run("finger.glb", "--motion", "curl.csv", "-o", "curl.npz") == 130
    assert "interrupted" in capsys.readouterr().err
    assert [path.name for path in place.iterdir()] == ["curl.csv"]


def test_rig_argument_names_files_and_built_in_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    from warpjld.cli.rig_argument import open_rig

    monkeypatch.setattr("warpjld.hand.kept.kept_hand", lambda side: side)
    monkeypatch.setattr(
        "warpjld.io.kept_rig.kept_rig", lambda path, **options: SimpleNamespace(name=f"rig of {path}", suspicious=())
    )
    assert [getattr(rig := open_rig(text), "name", rig) for text in ("builtin:right", "a/b.glb", "C:/b.glb")] == [
        "right",
        "rig of a/b.glb",
        "rig of C:/b.glb",
    ]
    with pytest.raises(InputError, match="builtin:left, builtin:right or builtin:body"):
        open_rig("builtin:foot")
    with pytest.raises(InputError, match="--unit only work for files"):
        open_rig("builtin:left", unit="cm")


@pytest.mark.slow
def test_a_polite_kill_leaves_nothing_behind(data: Path, tmp_path: Path) -> None:
    long = "\n".join(["frame,index.base.flexion", "0,0", "200000,60"])
    (tmp_path / "curl.csv").write_text(long)
    arguments = [sys.executable, "-m", "warpjld", "deform", str(data / "hand_webxr_generic" / "left.glb")]
    root = Path(__file__).parents[2]
    process = subprocess.Popen(
        [*arguments, "--motion", "curl.csv", "-o", "curl.pc2"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (root, root / "kernels")))},
    )
    while process.poll() is None and not list(tmp_path.glob(".curl.part*.pc2")):
        time.sleep(0.01)
    for _ in range(3):  # whoever ends a group of processes sends it to each, and some pass it on
        process.send_signal(signal.SIGTERM)
        time.sleep(0.02)
    assert process.wait(60) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["curl.csv"]


def test_a_batch_goes_on_past_a_clip_that_fails_and_says_so(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "broken.csv").write_text("frame,index.base.flexion\n0,much\n")
    assert run("finger.glb", "*.csv", "-o", "out", "--format", "npz", "--format", "pc2", "--processes", "1") == 1
    told = capsys.readouterr()
    assert "curl: 21 frames at 30 a second → curl.npz, curl.pc2, curl.rest.obj" in told.out
    assert "2 clips, 21 frames: 1 made" in told.out
    assert "failed: broken: broken.csv:2:2" in told.err
    (place / "broken.csv").unlink()
    assert run("finger.glb", "curl.csv", "-o", "out", "--format", "npz", "--format", "pc2", "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert (summary["made"], summary["failed"], summary["frames"]) == (0, 0, 21)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("curl.csv", "other.csv", "-o", "out"), "2 clips: want --format"),
        (("-o", "out"), "want a motion file after RIG"),
        (("*.bvh", "-o", "out", "--format", "pc2"), "no file fits the pattern '*.bvh'"),
        (("curl.csv", "-o", "curl.csv", "--format", "pc2"), "is a file; want a folder"),
    ],
)
def test_batches_that_cannot_be(
    place: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    assert run("finger.glb", *arguments) == 1
    assert message in capsys.readouterr().err
    assert [path.name for path in place.iterdir()] == ["curl.csv"]


@pytest.mark.slow
def test_a_killed_batch_goes_on_to_the_same_bytes(data: Path, tmp_path: Path) -> None:
    for k in range(8):
        rows = "\n".join(["frame,index.base.flexion", "0,0", f"1500,{20 + 5 * k}"])
        (tmp_path / f"curl{k:02d}.csv").write_text(rows)
    rig = str(data / "hand_webxr_generic" / "left.glb")
    command = [sys.executable, "-m", "warpjld", "deform", rig, "curl*.csv", "--format", "pc2", "-o"]
    root = Path(__file__).parents[2]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root), str(root / "kernels")])}
    process = subprocess.Popen([*command, "killed"], cwd=tmp_path, env=environment, start_new_session=True)
    out = tmp_path / "killed"
    while len(list((out / ".clips").glob("curl*.json"))) < 4:
        assert process.poll() is None
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)  # its workers with it, whatever they are writing
    process.wait()
    assert not (out / "manifest.json").exists()
    again = subprocess.run(
        [*command, "killed", "--json"], cwd=tmp_path, env=environment, check=True, stdout=subprocess.PIPE
    )
    assert 0 < json.loads(again.stdout)["made"] <= 4
    subprocess.run([*command, "whole", "--processes", "1", "-q"], cwd=tmp_path, env=environment, check=True)
    killed, whole = (
        {path.name: path.read_bytes() for path in (tmp_path / name).iterdir() if path.is_file()}
        for name in ("killed", "whole")
    )
    assert killed == whole
