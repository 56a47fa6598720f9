"""Parts of a hand in one another, and the volume of hand and object in one another, against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from tests.grasp.quality.winding import closed, distance, winding
from warpjld.covering import Covering
from warpjld.covering.intersections import surface_parts
from warpjld.geometry.normals import vertex_normals
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.quality import penetration, self_penetration
from warpjld.grasp.shapes import ball
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, poses_from_angles


def _bent(rig: Rig, covering: Covering, degrees: float) -> np.ndarray:
    """The index finger leans so far to the middle one."""
    angles = rig.skeleton.initial[None].copy()
    angles[0, rig.skeleton.index("index.base"), CHANNELS.index("abduction")] = np.radians(degrees)
    return covering.deform(poses_from_angles(rig.skeleton, angles), threads=1)[0]


def test_a_hand_at_rest_is_in_nothing(rig: Rig, covering: Covering) -> None:
    assert self_penetration(covering, _bent(rig, covering, 0.0)) == 0.0


@pytest.mark.parametrize("degrees", [-22.0, -26.0])
def test_a_finger_in_its_neighbour(rig: Rig, covering: Covering, degrees: float) -> None:
    skin = _bent(rig, covering, degrees)
    parts, faces = surface_parts(covering), covering.surface.faces
    points = skin.astype(np.float64)
    shell, normals = closed(points, faces), vertex_normals(skin, faces)
    index, middle = (parts.of_face == parts.names.index(f"left.{name}") for name in ("index", "middle"))
    deepest = 0.0
    for own, other in ((index, middle), (middle, index)):
        vertices = np.setdiff1d(faces[own], faces[other])
        inside = vertices[winding(points[vertices] + 1e-5 * normals[vertices], shell) > 0.5]
        deepest = max([deepest, *(distance(points[k], points[faces[other]]) for k in inside)])
    assert deepest > 1e-3
    assert self_penetration(covering, skin) == pytest.approx(deepest, rel=1e-3)


def test_the_volume_is_that_of_a_fine_sampling(rig: Rig, covering: Covering) -> None:
    """A ball half in the palm: low-discrepancy points of the exact ball, asked by winding number."""
    skin = rig.surface.vertices.astype(np.float32)
    wrist, knuckle = (rig.skeleton.rest[rig.skeleton.index(name)] for name in ("wrist", "middle.base"))
    middle = 0.5 * (wrist + knuckle)
    low = skin[np.linalg.norm((skin - middle)[:, [0, 2]], axis=1) < 0.01][:, 1].min()
    centre, radius = np.array([middle[0], low, middle[2]]), 0.012
    cube = 2.0 * qmc.Sobol(3, seed=1).random(2**12) - 1.0
    sample = centre + radius * cube[np.linalg.norm(cube, axis=1) <= 1.0]
    inside = winding(sample, closed(skin.astype(np.float64), covering.surface.faces)) > 0.5
    exact = inside.mean() * 4.0 / 3.0 * np.pi * radius**3
    assert 0.2 < inside.mean() < 0.8
    found = penetration(HandObjectGaps(covering, ball(2.0 * radius, subdivisions=4).placed(centre)), skin)
    assert found.volume == pytest.approx(exact, rel=0.015)
