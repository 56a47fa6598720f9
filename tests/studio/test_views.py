"""The CAMERA line of a view shows the same picture as the window."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from warpjld.render.camera import Camera
from warpjld.studio.document import ScriptDocument
from warpjld.studio.panels.views import camera_line
from warpjld.studio.state import StudioState


def test_a_view_becomes_a_camera_of_the_same_place_and_magnification(tmp_path: Path) -> None:
    state = StudioState(ScriptDocument(tmp_path / "a.jld", "HAND LEFT BUILTIN RESOLUTION 1500\n"), tmp_path / "out")
    assert state.do(camera_line((0.1, 0.2, 0.30004), (0.0, 0.01, 0.0), 0.6))
    camera = state.scene.camera
    assert camera.position == (0.1, 0.2, 0.3)
    assert camera.target == (0.0, 0.01, 0.0)
    # half the picture's height at unit distance
    assert math.tan(Camera.angle / 2) / camera.zoom == pytest.approx(math.tan(0.3), rel=2e-3)
    assert camera_line((0.1, 0.2, 0.3), (0.0, 0.0, 0.0), Camera.angle) == "CAMERA FROM 0.1 0.2 0.3 TO 0 0 0"


def test_presets_are_those_of_pictures(tmp_path: Path) -> None:
    state = StudioState(ScriptDocument(tmp_path / "a.jld", "HAND LEFT BUILTIN RESOLUTION 1500\n"), tmp_path / "out")
    palmar, dorsal = (state.surfaces.camera(state.scene, 0.0, view, (400, 300)) for view in ("palmar", "dorsal"))
    towards = [np.subtract(camera.target, camera.position) for camera in (palmar, dorsal)]
    cosine = np.dot(*towards) / np.prod([np.linalg.norm(way) for way in towards])
    assert cosine < -0.99  # they face each other
