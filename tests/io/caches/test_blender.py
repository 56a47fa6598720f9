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
    for suffix in ("usdc", "usda", "abc", "pc2", "mdd", "obj", "glb", "npz"):
        export(f"{suffix}.{suffix}")
    script = Path(__file__).with_name("in_blender.py")
    arguments = [python, str(script), str(tmp_path), "3", "7", "24", str(tmp_path / "shown.npz")]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    with np.load(tmp_path / "npz.npz") as cache:
        x, y, z = np.moveaxis(cache["vertices"], -1, 0)
        uv = cache["uv"]
        first = cache["vertices"][0].astype(np.float64)
        a, b, c = (first - first.mean(axis=0))[cache["faces"].T]
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    expected = np.stack([x, -z, y], axis=-1)  # Blender's Z is up, -Y is forward
    with np.load(tmp_path / "shown.npz") as shown:
        for suffix in ("usdc", "usda", "abc", "pc2", "mdd", "obj", "glb"):
            assert shown[suffix].shape == expected.shape, suffix
            error = np.abs(shown[suffix] - expected).max(axis=(1, 2))
            assert error.max() < TOLERANCE, f"{suffix}: {error} by frame"
        for suffix in ("abc", "glb"):
            np.testing.assert_allclose(shown[f"{suffix}_uv"], uv[shown[f"{suffix}_corner"]], atol=1e-6)
        assert shown["abc_outside"] == pytest.approx(volume, rel=1e-4)  # of the right sign: faces look outwards
