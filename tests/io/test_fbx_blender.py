"""FBX as Blender writes it, against the same scene as GLB. Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from warpjld.io import load_rig
from warpjld.io.fbx.rig import read_fbx_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.motion.fbx_animation import read_fbx_animation
from warpjld.motion.gltf_animation import read_gltf_animation

pytest.importorskip("ufbx")

PLACE, TURN = 1e-6, 1e-5
"""Keys are single floats: down a chain of joints they add up."""
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FILES = (
    "hand_webxr_generic/left.glb",
    "hand_anny/right.glb",
    "body_mesh2motion_mannequin/human-male.glb",
    "body_anny/body_lowpoly_163joints.glb",
)


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_blenders_fbx_is_the_rig_and_the_animation_of_the_glb(tmp_path: Path, file: str) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    if not (DATA / file).exists():
        pytest.skip(f"no {DATA / file}")
    fbx, glb = tmp_path / "scene.fbx", tmp_path / "scene.glb"
    arguments = [python, str(Path(__file__).with_name("fbx_from_blender.py")), str(DATA / file), str(fbx), str(glb)]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    rig, expected = read_fbx_rig(fbx), read_gltf_rig(glb)
    assert sorted(rig.tree.names) == sorted(expected.tree.names)
    same = [rig.tree.names.index(name) for name in expected.tree.names]
    np.testing.assert_allclose(rig.tree.positions[same], expected.tree.positions, atol=PLACE)
    # bones lie along other axes of their own in either file, the same for all bones
    frames = expected.tree.frames[:, :3, :3]
    turns = np.linalg.inv(rig.tree.frames[same][:, :3, :3]) @ (frames / np.linalg.norm(frames, axis=1)[:, None])
    apart = Rotation.from_matrix(turns) * Rotation.from_matrix(turns).mean().inv()
    assert apart.magnitude().max() < TURN
    for a, b in ((rig, expected), (expected, rig)):
        assert cKDTree(a.vertices).query(b.vertices)[0].max() < PLACE
    assert load_rig(fbx).skeleton.names == load_rig(glb).skeleton.names
    read, wanted = read_fbx_animation(fbx), read_gltf_animation(glb, rate=24.0)
    assert read.rate == 24.0
    assert len(read) == len(wanted) == 8
    same = [read.tree.names.index(name) for name in wanted.tree.names]
    # an FBX file holds angles in degrees in single precision, half a unit of which is 1e-7 rad at every joint of a
    # chain: two files of one animation lie apart by a millionth of the body
    size = max(1.0, float(np.ptp(expected.vertices, axis=0).max()))
    np.testing.assert_allclose(read.worlds[:, same][..., :3, 3], wanted.worlds[..., :3, 3], atol=PLACE * size)
    flesh = [
        Rotation.from_matrix((worlds @ np.linalg.inv(rest))[..., :3, :3].reshape(-1, 3, 3))
        for worlds, rest in ((read.worlds[:, same], read.tree.frames[same]), (wanted.worlds, wanted.tree.frames))
    ]
    assert (flesh[0] * flesh[1].inv()).magnitude().max() < TURN
