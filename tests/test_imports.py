"""Importing is quick and starts nothing: heavy and optional packages load when they are first used."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = [
    "warp",
    "pyvista",
    "vtk",
    "vtkmodules",
    "pxr",
    "matplotlib",
    "imageio",
    "imageio_ffmpeg",
    "PIL",
    "trimesh",
    "pygltflib",
]


@pytest.mark.parametrize("modules", ["warpjld", "warpjld.io.caches, warpjld.render"])
def test_import_loads_nothing_heavy(modules: str) -> None:
    script = f"import sys, {modules}; print(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert not set(HEAVY) & set(done.stdout.split())
