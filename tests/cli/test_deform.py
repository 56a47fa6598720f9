"""``warpjld deform`` end to end on a small finger, and its refusals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.skeleton import Skeleton, default_limits
from warpjld.surface import weld_surface

MOTION = "frame,index.base.flexion,index.knuckle2.flexion\n0,0,0\n20,60,90\n"


def finger() -> Rig:
    """Two phalanges along -z in a closed tube."""
    names = ("left.index.base", "left.index.knuckle2", "left.index.tip")
    rest = np.array([[0, 0, 0], [0, 0, -0.05], [0, 0, -0.09]])
    skeleton = Skeleton(
        names, np.array([-1, 0, 1], dtype=np.int32), rest, np.tile([-1.0, 0, 0], (3, 1)), default_limits(names)
    )
    around, along = np.meshgrid(np.arange(16) * np.pi / 8, np.linspace(0.005, -0.095, 21), indexing="xy")
    ring = np.stack([0.008 * np.cos(around), 0.008 * np.sin(around), along], axis=-1).reshape(-1, 3)
    vertices = np.vstack([ring, [[0, 0, 0.01], [0, 0, -0.1]]])
    faces = []
    for i in range(20):
        for k in range(16):
            a, b = 16 * i + k, 16 * i + (k + 1) % 16
            faces += [[a, a + 16, b], [b, a + 16, b + 16]]
    faces += [[336, k, (k + 1) % 16] for k in range(16)]
    faces += [[337, 320 + (k + 1) % 16, 320 + k] for k in range(16)]
    return Rig("finger", skeleton, weld_surface(vertices, faces))


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
    assert "note: left.index.base.flexion: in-betweens of frames 11 to" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--motion", "curl.csv", "-o", "curl.xyz"), "unknown kind of cache '.xyz'"),
        (("--motion", "none.csv", "-o", "curl.npz"), "none.csv: cannot be read"),
        (("--motion", "curl.fbx", "-o", "curl.npz"), "unknown kind of motion '.fbx'"),
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

    monkeypatch.setattr("warpjld.hand.build_hand", lambda side: side)
    monkeypatch.setattr(
        "warpjld.io.load_rig", lambda path, **options: SimpleNamespace(name=f"rig of {path}", suspicious=())
    )
    assert [getattr(rig := open_rig(text), "name", rig) for text in ("builtin:right", "a/b.glb", "C:/b.glb")] == [
        "right",
        "rig of a/b.glb",
        "rig of C:/b.glb",
    ]
    with pytest.raises(InputError, match="builtin:left or builtin:right"):
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
    while process.poll() is None and not list(tmp_path.glob("*.part")):
        pass
    process.send_signal(signal.SIGTERM)
    assert process.wait(60) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["curl.csv"]
