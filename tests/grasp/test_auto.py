"""Grasps found without help: postures by shape, wrist placements, the best hand."""

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp import ObjectSet
from warpjld.grasp.auto import find_grasp
from warpjld.grasp.both_ways import BothWays
from warpjld.grasp.close import Closer
from warpjld.grasp.draws import WAY
from warpjld.grasp.judge import Judge
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.obstacles import COLLIDES, Obstacles
from warpjld.grasp.placements import sample_wrists
from warpjld.grasp.postures import POSTURES, posture_angles, posture_for
from warpjld.grasp.quality import penetration
from warpjld.grasp.shapes import ball, box, cylinder, glass, plate
from warpjld.skeleton import poses_from_angles


def test_a_plate_is_not_held_as_a_glass() -> None:
    wanted = {plate: "plate", glass: "cylinder", ball: "sphere", cylinder: "cylinder"}
    assert {make: posture_for(make().size) for make in wanted} == wanted
    assert posture_for(np.array([0.2, 0.004, 0.15])) == "plate"


@pytest.mark.parametrize("name", POSTURES)
def test_postures_are_within_the_limits(rig, name: str) -> None:
    angles = posture_angles(rig.skeleton, "left", name)
    low, high = np.moveaxis(rig.skeleton.limits, -1, 0)
    assert ((angles >= low - 1e-12) & (angles <= high + 1e-12) | (angles == 0)).all()
    assert angles[rig.skeleton.index("thumb.base")].any()


def test_sampled_hands_are_next_to_the_object_and_not_in_it(covering) -> None:
    thing = box().placed((0.3, 0.2, 0.1), (0.3, 0.1, 0.2, 0.9))
    angles = posture_angles(covering.skeleton, "left", "cylinder")
    found = sample_wrists(covering, angles, NearObject(thing), "left", 12, np.random.default_rng(0))
    poses = poses_from_angles(
        covering.skeleton,
        np.repeat(angles[None], 12, axis=0),
        root_position=found.position,
        root_rotation=found.rotation,
    )
    gap = ObjectSet(thing).distances(covering.deform(poses), which=np.zeros(12, int)).distance.min(axis=1)
    assert (gap > 0).all()
    assert (gap < 1e-3).sum() >= 9  # a few pass by
    np.testing.assert_allclose(np.linalg.norm(found.approach, axis=1), 1, atol=1e-12)


def test_finding_a_grasp(covering) -> None:
    thing = ball(0.06, subdivisions=3).placed((1.0, 0.5, 0.0))
    found = find_grasp(Closer(covering, thing), count=8, seed=1)
    assert found.posture == "sphere"
    assert found.verdict.closed
    assert found.verdict.epsilon > 0.05
    assert len(found.touching) >= 3
    skin = covering.deform(found.poses(covering.skeleton))[0]
    seen = penetration(BothWays(covering, thing), skin)
    assert seen.depth <= 6e-4
    again = find_grasp(Closer(covering, thing), count=8, seed=1)
    np.testing.assert_array_equal(found.angles, again.angles)
    np.testing.assert_array_equal(found.position, again.position)


def test_a_verdict_knows_which_contacts_press(covering) -> None:
    """A ball that lies on the back of the hand is touched and not held."""
    skeleton = covering.skeleton
    knuckle = skeleton.rest[skeleton.index("middle.base")]
    poses = poses_from_angles(skeleton, np.zeros((1, len(skeleton), 4)))
    skin = covering.deform(poses)[0]
    top = skin[np.linalg.norm((skin - knuckle)[:, [0, 2]], axis=1) < 0.005][:, 1].max()
    lying = ball(0.06).placed([knuckle[0], top + 0.0301, knuckle[2]])
    both = BothWays(covering, lying)
    (verdict,) = Judge(both, "left", 0.6).judge(poses, skin[None], both.depths(skin[None]).max(axis=1))
    assert (verdict.closed, verdict.digits, verdict.palm, verdict.score) == (False, (), False, 0.0)


def test_a_hand_does_not_reach_through_the_table(covering) -> None:
    """A ball on a table is taken from above; without the table it may be taken from anywhere."""
    thing, table = ball(0.06, subdivisions=3), box(0.4, 0.02, 0.4, name="table").placed((0.0, -0.04, 0.0))
    obstacle = Obstacles(covering, [table])
    depths = []
    for obstacles in ([], [table]):
        found = find_grasp(Closer(covering, thing), obstacles=obstacles, count=16, seed=1)
        assert found.verdict.closed
        poses = found.poses(covering.skeleton)
        depths.append(obstacle.depth(covering.deform(poses)))
    assert depths[0] > 5e-3
    assert depths[1] <= COLLIDES
    assert found.approach[1] < 0.0
    # it came there without the table in its way
    ways = np.linspace(0.0, WAY, 5)[:, None] * found.approach
    turns, angles = np.repeat(found.rotation[None], 5, axis=0), np.repeat(found.start[None], 5, axis=0)
    poses = poses_from_angles(covering.skeleton, angles, root_position=found.position - ways, root_rotation=turns)
    assert obstacle.depth(covering.deform(poses)) <= COLLIDES


def test_what_is_walled_in_is_told(covering) -> None:
    walls = box(0.2, 0.2, 0.2, name="crate")
    with pytest.raises(InputError, match="or out of reach: crate blocked 64 more"):
        find_grasp(Closer(covering, ball(0.06, subdivisions=2)), obstacles=[walls], count=8)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"count": 0}, "want 1 or more"),
        ({"side": "right"}, "want one of left"),
        ({"posture": "fist"}, "no posture 'fist'"),
        ({"friction": 0.0}, "friction: want a number above 0"),
    ],
)
def test_wrong_wishes(covering, options: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        find_grasp(Closer(covering, ball()), **options)


def test_what_no_hand_can_hold_is_told(covering) -> None:
    with pytest.raises(InputError, match="none of 6 placements ends in a grasp"):
        find_grasp(Closer(covering, ball(2.0, subdivisions=3)), count=6)
