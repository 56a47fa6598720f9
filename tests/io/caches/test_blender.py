"""What Blender shows of every cache, against the NPZ. Wants a Python with `bpy`, named by WARPJLD_BPY_PYTHON."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.io.caches import Cache

# float32 rounding of rotated positions of a few decimetres; asked for: 1e-5
TOLERANCE = 1e-6


@pytest.mark.slow
def test_blender_shows_the_same_vertices(export: Callable[[str], Cache], tmp_path: Path) -> None:
    python = os.environ.get("WARPJLD_BPY_PYTHON")
    if not python:
        pytest.skip("WARPJLD_BPY_PYTHON does not name a Python that has bpy")
    for suffix in ("usdc", "usda", "pc2", "mdd", "obj", "glb", "npz"):
        export(f"{suffix}.{suffix}")
    script = Path(__file__).with_name("in_blender.py")
    arguments = [python, str(script), str(tmp_path), "3", "7", "24", str(tmp_path / "shown.npz")]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    with np.load(tmp_path / "npz.npz") as cache:
        x, y, z = np.moveaxis(cache["vertices"], -1, 0)
        uv = cache["uv"]
    expected = np.stack([x, -z, y], axis=-1)  # Blender's Z is up, -Y is forward
    with np.load(tmp_path / "shown.npz") as shown:
        for suffix in ("usdc", "usda", "pc2", "mdd", "obj", "glb"):
            assert shown[suffix].shape == expected.shape, suffix
            error = np.abs(shown[suffix] - expected).max(axis=(1, 2))
            assert error.max() < TOLERANCE, f"{suffix}: {error} by frame"
        np.testing.assert_allclose(shown["glb_uv"], uv[shown["corner"]], atol=1e-6)
