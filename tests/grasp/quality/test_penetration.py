"""Penetration of shapes whose depth and volume are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.covering import Covering
from warpjld.grasp.quality import depth_inside, penetration
from warpjld.grasp.shapes import ball, box
from warpjld.rig import Rig

_BALL = trimesh.creation.icosphere(subdivisions=4, radius=0.02)


def test_depth_of_points_in_a_ball() -> None:
    points = np.array([[0.0, 0.0, 0.015], [0.012, 0.0, 0.0], [0.05, 0.0, 0.0]])
    assert depth_inside(points, _BALL.vertices, _BALL.faces.astype(np.int32)) == pytest.approx(0.008, abs=5e-5)
    assert depth_inside(points[2:], _BALL.vertices, _BALL.faces.astype(np.int32)) == 0.0
    assert depth_inside(np.array([[0.0145, 0.0145, 0.0]]), _BALL.vertices, _BALL.faces.astype(np.int32)) == 0.0


def test_an_open_surface_still_has_an_inside() -> None:
    keep = _BALL.triangles_center[:, 2] > -0.017
    faces = _BALL.faces[keep].astype(np.int32)
    assert len(faces) < len(_BALL.faces)
    depth = depth_inside(np.array([[0.0, 0.0, 0.01]]), _BALL.vertices, faces)
    assert depth == pytest.approx(0.01, abs=5e-5)


def test_a_corner_between_skin_vertices_is_found_from_its_own_side(rig: Rig, covering: Covering) -> None:
    """A box whose corner lies inside the palm holds no skin vertex there, or a less deep one."""
    skin = rig.surface.vertices.astype(np.float32)
    middle = 0.5 * (
        rig.skeleton.rest[rig.skeleton.index("wrist")] + rig.skeleton.rest[rig.skeleton.index("middle.base")]
    )
    away = penetration(covering, skin, ball(0.03).placed(middle + np.array([0.0, 0.2, 0.0])))
    assert (away.depth, away.volume) == (0.0, 0.0)
    inner = ball(0.008, subdivisions=3).placed(middle)  # swallowed: no skin vertex is inside it
    swallowed = penetration(covering, skin, inner)
    assert swallowed.skin == 0.0
    assert swallowed.thing > 0.008 / 2.0
    assert swallowed.volume == pytest.approx(np.pi / 6.0 * 0.008**3, rel=0.05)
    palm = skin[np.linalg.norm((skin - middle)[:, [0, 2]], axis=1) < 0.01][:, 1].min()
    slab = box(0.3, 0.02, 0.3).placed([0.0, palm + 0.002 - 0.01, 0.0])  # its top is 2 mm above the palm's skin
    assert penetration(covering, skin, slab).skin >= 0.0019
