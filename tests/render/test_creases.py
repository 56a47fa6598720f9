from __future__ import annotations

import numpy as np
import trimesh

from warpjld.render.creases import Shading


def test_box_corners_become_three() -> None:
    box = trimesh.creation.box()
    shading = Shading(np.array(box.vertices), np.array(box.faces), angle=0.7)
    assert len(shading.origin) == 24
    points, normals = shading.place(np.array(box.vertices))
    np.testing.assert_array_equal(points[shading.faces], box.vertices[box.faces].astype(np.float32))
    np.testing.assert_allclose(normals[shading.faces[:, 0]], box.face_normals, atol=1e-6)


def test_smooth_surface_stays_whole() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    shading = Shading(np.array(ball.vertices), np.array(ball.faces), angle=0.7)
    assert len(shading.origin) == len(ball.vertices)


def test_open_border_is_no_crease() -> None:
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    shading = Shading(sheet, np.array([[0, 1, 2], [0, 2, 3]]), angle=0.7)
    assert len(shading.origin) == 4
