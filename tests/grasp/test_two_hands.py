"""Two hands on what is too wide for one."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from warpjld.covering.kept import bind_kept
from warpjld.errors import InputError
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.quality import Contacts, least_resistance
from warpjld.grasp.segments import SEGMENTS, vertex_segments
from warpjld.grasp.shapes import ball, box, cylinder
from warpjld.grasp.two_hands import find_two_handed


@pytest.fixture(scope="module")
def both(hands):
    return {side: bind_kept(rig)[0] for side, rig in hands.items()}


@pytest.mark.slow
def test_palms_are_opposed_across_a_crate(both) -> None:
    thing = box(0.4, 0.3, 0.35).placed((0.1, 0.9, 0.3), (0.0, 0.3, 0.0, 0.95))
    found = find_two_handed(both, thing, count=24)
    left, right = found["left"], found["right"]
    assert left.approach @ right.approach == pytest.approx(-1.0)
    assert left.verdict is right.verdict
    assert left.verdict.closed
    assert left.touching
    assert right.touching
    skins = {side: both[side].deform(one.poses(both[side].skeleton))[0] for side, one in found.items()}
    for side, skin in skins.items():
        assert HandObjectGaps(both[side], thing).depths(skin[None]).max() < 6e-4
    assert cKDTree(skins["left"]).query(skins["right"])[0].min() > 0.2  # the crate is between them


@pytest.mark.parametrize(
    "thing", [pytest.param(box(0.2, 0.2, 0.2), marks=pytest.mark.slow), cylinder(0.3, 0.3)], ids=["box", "cylinder"]
)
def test_palms_press(both, thing) -> None:
    """By the skin itself, not by the verdict: a vertex of each palm within a millimetre of the object."""
    found = find_two_handed(both, thing, count=24)
    assert {one.posture for one in found.values()} == {"palms"}
    solid = trimesh.Trimesh(thing.vertices, thing.faces, process=False)
    for side, grasp in found.items():
        skin = both[side].deform(grasp.poses(both[side].skeleton))[0]
        palm = skin[vertex_segments(both[side], side) == SEGMENTS.index("palm")]
        _, away, _ = trimesh.proximity.closest_point(solid, palm)
        assert away.min() < 1e-3
        assert grasp.verdict.closed


def test_contacts_of_both_hands_count_together() -> None:
    """Two palms, a soft contact each: neither alone is force closed, both together are."""
    points, normals = np.array([[-0.2, 0, 0], [0.2, 0, 0]]), np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    spin = np.full(2, 0.01)
    together = Contacts(points, normals, np.array(0.6), spin)
    assert least_resistance(together, np.zeros(3), torque_scale=0.3) > 0.0
    alone = Contacts(points[:1], normals[:1], np.array(0.6), spin[:1])
    assert least_resistance(alone, np.zeros(3), torque_scale=0.3) == 0.0


def test_wrong_wishes(both) -> None:
    with pytest.raises(InputError, match="want a left and a right one, got left"):
        find_two_handed({"left": both["left"]}, ball(0.3))
    with pytest.raises(InputError, match="none of 4 placements of two hands"):
        find_two_handed(both, ball(0.01, subdivisions=2), count=4)
