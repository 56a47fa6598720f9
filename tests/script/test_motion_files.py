"""Motions that scripts export: on the stage, on the rig's own joints."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.motion.out.bvh_reader import evaluate
from warpjld.errors import InputError
from warpjld.motion.out import write
from warpjld.script.runner import run_scene
from warpjld.script.staging import frame_numbers, stage

pytestmark = pytest.mark.usefixtures("quick_hands")
BENT = (
    "RATE 24\nFINGER1 LEFT INDEX FLEXION AT 2 0\nFINGER1 LEFT INDEX FLEXION AT 6 60\n"
    "MOVE LEFT 2 0 0 0\nMOVE LEFT 6 0.3 1 0\n"
)


def test_the_motion_on_the_stage_is_written(run, tmp_path) -> None:
    scene = run(BENT + "TURN LEFT 2 0 0 0\nTURN LEFT 6 0 90 0\nEXPORT_MOTION 'sub/a.bvh'\nEXPORT_MOTION 'a.glb' left")
    summary = run_scene(scene, tmp_path)
    assert {file["name"] for file in summary["files"]} == {"sub/a.bvh", "a.glb"}
    names, _, _, worlds, seconds = evaluate(tmp_path / "sub" / "a.bvh")
    assert seconds == pytest.approx(1 / 24)
    actor = scene.actor()
    poses = stage(actor, frame_numbers(scene), 24.0)
    assert len(worlds) == len(poses) == 5
    own = [names.index(name) for name in actor.skeleton.names]
    np.testing.assert_allclose(worlds[:, own][..., :3, 3], poses.positions, atol=1e-6)
    assert "sub/a.bvh: BVH has no frame numbers: the first frame is frame 2" in summary["notes"]


def test_each_actor_has_a_file_of_its_own(run, tmp_path) -> None:
    scene = run(BENT + "HAND RIGHT BUILTIN RESOLUTION 1500\nEXPORT_MOTION 'two.bvh'\nEXPORT_MOTION 'one.bvh' right")
    dry = run_scene(scene, tmp_path, dry=True)
    made = {"two-left.bvh", "two-right.bvh", "one.bvh"}
    assert {file["name"] for file in dry["files"]} == made
    run_scene(scene, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == made | {"summary.json"}
    assert "right.wrist" in evaluate(tmp_path / "two-right.bvh")[0]
    assert json.loads((tmp_path / "summary.json").read_text())["frames"]["count"] == 5


def test_what_goes_wrong_is_told_with_its_line(run, tmp_path, monkeypatch) -> None:
    def fails(path, rig, poses, timing):
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(write._WRITERS, ".bvh", ("tests_fail", "write_bvh"))
    monkeypatch.setattr(write, "import_module", lambda name: type("Module", (), {"write_bvh": fails}))
    scene = run(BENT + "EXPORT_MOTION 'a.bvh'")
    with pytest.raises(InputError, match=r"<script>:6:1: 'a\.bvh': cannot be written: No space left on device"):
        run_scene(scene, tmp_path)
    assert list(tmp_path.iterdir()) == []
