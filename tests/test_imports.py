"""Importing is quick and starts nothing: heavy and optional packages load when they are first used."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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


_STARTED = """
import sys
import warpjld.cli.deform as deform
loaded = {"numpy", "warp", "scipy"} & set(sys.modules)
assert not loaded, loaded
import warpjld.cli.read_ahead as read_ahead
class Ahead:
    def __init__(self, *request):
        print(sorted({"numpy", "warp", "scipy"} & set(sys.modules)), request[1])
        sys.exit()
read_ahead.Ahead = Ahead
read_ahead.cores = lambda: 2
deform.deform_command(sys.argv[1:])
"""


@pytest.mark.parametrize("out", [("-o", "body.pc2"), ("--motion-out", "body.bvh", "--motion-out", "body.usda")])
def test_reading_ahead_starts_before_numpy(tmp_path: Path, out: tuple[str, ...]) -> None:
    for name in ("rig.glb", "walk.bvh"):
        (tmp_path / name).touch()
    command = [sys.executable, "-c", _STARTED, "rig.glb", "walk.bvh", *out]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "[] rig.glb\n", done.stderr


_DEFORM = """
import sys
from warpjld.cli import main
try:
    main(sys.argv[1:])
except SystemExit as done:
    assert not done.code
print(*sorted({name.partition('.')[0] for name in sys.modules}))
"""


def _loaded(*arguments: object, **environment: str) -> set[str]:
    """Packages that a command has loaded when it is done."""
    command = [sys.executable, "-c", _DEFORM, *map(str, arguments)]
    done = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_a_kept_hand_is_deformed_without_scipy(tmp_path: Path) -> None:
    motion = tmp_path / "motion.csv"
    motion.write_text("frame,left.index.base.flexion\n0,0\n1,30\n")
    arguments = ("deform", "builtin:left", motion, "-o", tmp_path / "hand.pc2", "--quiet")
    _loaded(*arguments)  # kept from here on, if no other test had it made
    assert not {"scipy", "pyvista", "trimesh", "pygltflib"} & _loaded(*arguments)


@pytest.mark.slow
def test_a_kept_rig_is_deformed_by_a_bvh_without_scipy(tmp_path: Path, data: Path) -> None:
    rig, motion = data / "body_anny" / "body_lowpoly_163joints.glb", data / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh"
    arguments = ("deform", rig, motion, "-o", tmp_path / "body.pc2", "--frames", "0:3", "--quiet")
    assert "scipy" in _loaded(*arguments, WARPJLD_CACHE=str(tmp_path))
    assert not {"scipy", "pyvista", "trimesh"} & _loaded(*arguments, WARPJLD_CACHE=str(tmp_path))
