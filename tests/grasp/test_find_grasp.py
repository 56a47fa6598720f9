"""Grasps found without help: postures by shape, wrist placements, the best hand."""

from dataclasses import replace

import numpy as np
import pytest

from warpjld.covering import bind
from warpjld.errors import InputError
from warpjld.grasp import ObjectSet
from warpjld.grasp.approach_directions import free_ways
from warpjld.grasp.close import Closer
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.find_grasp import find_grasp
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.idle_fingers import idle_fingers_relaxed
from warpjld.grasp.judge import Judge
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import make_object
from warpjld.grasp.obstacles import COLLIDES, Obstacles
from warpjld.grasp.placements import sample_wrists
from warpjld.grasp.postures import POSTURES, posture_angles, posture_for
from warpjld.grasp.quality import penetration
from warpjld.grasp.random_placements import WAY
from warpjld.grasp.shapes import ball, box, cylinder, glass, plate
from warpjld.grasp.widths import sample_widths
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.channels import FLEXION

DIGITS = ["l.pinky", "l.ring", "l.middle", "l.index", "l.thumb"]


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
    found = find_grasp(covering, thing, count=8, seed=1)
    assert found.posture == "sphere"
    assert found.verdict.closed
    assert found.verdict.epsilon > 0.05
    assert len(found.touching) >= 3
    skin = covering.deform(found.poses(covering.skeleton))[0]
    seen = penetration(HandObjectGaps(covering, thing), skin)
    assert seen.depth <= 6e-4
    again = find_grasp(covering, thing, count=8, seed=1)
    np.testing.assert_array_equal(found.angles, again.angles)
    np.testing.assert_array_equal(found.position, again.position)


def test_a_finger_that_misses_follows_the_one_beside_it(covering) -> None:
    """The little finger would close into a fist beside the ball."""
    thing, skeleton = ball(0.05), covering.skeleton
    closer = Closer(covering, thing)
    found = find_grasp(covering, thing, closer=closer, count=8, seed=0, posture="sphere")
    assert "left.ring" in found.touching
    assert "left.pinky" not in found.touching
    chains = {digit: list(joints) for digit, joints in digit_chains(skeleton).items()}
    little, ring = (found.angles[chains[f"left.{digit}"], FLEXION] for digit in ("pinky", "ring"))
    assert (little <= ring + 1e-12).all()
    assert found.penetration <= 6e-4
    open_hand = poses_from_angles(
        skeleton, found.start[None], root_position=found.position[None], root_rotation=found.rotation[None]
    )
    fist = closer.close(open_hand, found.start[None], coupling=(1.0, 0.7)).angles[0]
    assert (fist[chains["left.pinky"], FLEXION] > ring + 0.1).all()
    touching = [chains[digit] for digit in found.touching]
    np.testing.assert_allclose(fist[np.concatenate(touching), FLEXION], found.angles[np.concatenate(touching), FLEXION])


@pytest.mark.parametrize("closing", [["l.middle", "l.index", "l.thumb"], DIGITS])
@pytest.mark.parametrize("touching", [["l.index", "l.thumb"], ["l.middle", "l.index"], ["l.thumb"], ["l.pinky"]])
def test_idle_fingers_follow_the_nearest_that_touches(touching: list[str], closing: list[str]) -> None:
    chains = {digit: (3 * k, 3 * k + 1, 3 * k + 2) for k, digit in enumerate(DIGITS)}
    angles = np.random.default_rng(3).uniform(0.0, 1.5, (15, 4))
    found = idle_fingers_relaxed(angles, chains, touching, closing, 0.5)
    for digit, joints in chains.items():
        rows = list(joints)
        expected = angles[rows, FLEXION]
        if digit not in (*touching, "l.thumb") and touching != ["l.thumb"]:
            # touching fingers are listed from the middle one on: the first is nearest to all but the index finger
            other = angles[list(chains[touching[0]]), FLEXION]
            follows = digit in closing
            expected = np.minimum(expected, other) if follows else np.maximum(expected, 0.5 * other)
        np.testing.assert_array_equal(found[rows, FLEXION], expected)
    np.testing.assert_array_equal(np.delete(found, FLEXION, axis=1), np.delete(angles, FLEXION, axis=1))


def test_fingers_that_take_no_part_in_a_pinch_are_not_straight(covering) -> None:
    found = find_grasp(covering, ball(0.04), count=16, seed=0, posture="pinch")
    assert not {"left.ring", "left.pinky"} & set(found.touching)
    chains = digit_chains(covering.skeleton)
    middle, ring, pinky = (found.angles[list(chains[f"left.{d}"]), FLEXION] for d in ("middle", "ring", "pinky"))
    np.testing.assert_allclose(ring, 0.5 * middle)
    np.testing.assert_allclose(pinky, 0.5 * middle)
    assert (middle[:2] > 0.2).all()
    assert found.penetration <= 6e-4


def test_a_verdict_knows_which_contacts_press(covering) -> None:
    """A ball that lies on the back of the hand is touched and not held."""
    skeleton = covering.skeleton
    knuckle = skeleton.rest[skeleton.index("middle.base")]
    poses = poses_from_angles(skeleton, np.zeros((1, len(skeleton), 4)))
    skin = covering.deform(poses)[0]
    top = skin[np.linalg.norm((skin - knuckle)[:, [0, 2]], axis=1) < 0.005][:, 1].max()
    lying = ball(0.06).placed([knuckle[0], top + 0.0301, knuckle[2]])
    both = HandObjectGaps(covering, lying)
    (verdict,) = Judge(both, "left", 0.6).judge(poses, skin[None], both.depths(skin[None]).max(axis=1))
    assert (verdict.closed, verdict.digits, verdict.palm, verdict.score) == (False, (), False, 0.0)


def test_a_contact_counts_as_much_as_closing_presses_it(covering) -> None:
    """Against the way that the nearest segment really goes as all joints of its digit flex by a little."""
    thing, skeleton = ball(0.06), covering.skeleton
    closer = Closer(covering, thing)
    found = find_grasp(covering, thing, closer=closer, count=8, seed=1)
    closed = found.poses(skeleton)
    chains, angles = digit_chains(skeleton), found.angles.copy()
    angles[np.concatenate(list(chains.values())), FLEXION] += 1e-4
    after = replace(found, angles=angles).poses(skeleton)
    (pressing,) = Judge(closer.both, "left", 0.6).pressing(closed, covering.deform(closed), after)
    skins = [covering.deform(poses)[0].astype(np.float64) for poses in (closed, after)]
    cosines = []
    for point, normal in zip(pressing.contacts.points, pressing.contacts.normals, strict=True):
        ways = (skins[1] - skins[0])[np.linalg.norm(skins[0] - point, axis=1) < 0.006]  # skin near the contact
        cosines.append(float((ways @ normal / np.linalg.norm(ways, axis=1)).mean()))
    straight = pressing.straight
    assert len(straight) == len(pressing.contacts) >= 4
    of_digits = straight[:-1] if pressing.palm else straight  # the palm comes last
    apart = np.abs(np.maximum(cosines[: len(of_digits)], 0.0) - of_digits)
    assert np.median(apart) < 0.05  # skin is not rigid on its bone
    assert apart.max() < 0.1
    assert (straight[len(of_digits) :] == 1.0).all()
    assert 0.0 < found.verdict.tightening < found.verdict.epsilon
    assert found.verdict.firmness == pytest.approx(found.verdict.tightening + 0.01 * len(found.verdict.digits))


def test_a_hand_does_not_reach_through_the_table(covering) -> None:
    """A ball on a table is taken from above; without the table it may be taken from anywhere."""
    thing, table = ball(0.06, subdivisions=3), box(0.4, 0.02, 0.4, name="table").placed((0.0, -0.04, 0.0))
    obstacle = Obstacles(covering, [table])
    depths = []
    for obstacles in ([], [table]):
        found = find_grasp(covering, thing, obstacles=obstacles, count=16, seed=1)
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
        find_grasp(covering, ball(0.06, subdivisions=2), obstacles=[walls], count=8)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"count": 0}, "want 1 or more"),
        ({"side": "right"}, "want one of left"),
        ({"posture": "fist"}, "no posture 'fist'"),
        ({"friction": 0.0}, "friction: want a number above 0"),
        ({"digits": ("index", "pinky")}, "want thumb and one or more of index, middle, ring"),
    ],
)
def test_wrong_wishes(covering, options: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        find_grasp(covering, ball(), **options)


@pytest.mark.slow
def test_two_digits_that_are_named_oppose_each_other(covering) -> None:
    edge = 0.04
    thing = box(edge, edge, edge)
    found = find_grasp(covering, thing, digits=("thumb", "index"), count=64)
    assert found.touching == ("left.thumb", "left.index")
    both = HandObjectGaps(covering, thing)
    poses = found.poses(covering.skeleton)
    (pressing,) = Judge(both, "left", 0.6).pressing(poses, covering.deform(poses))
    normals = pressing.contacts.normals
    assert (normals @ normals.T).min() < -0.8  # on opposite sides
    assert np.linalg.norm(pressing.contacts.points.mean(axis=0) - thing.centroid) < 0.5 * edge


def test_what_no_hand_can_span_is_told_with_both_widths(covering) -> None:
    with pytest.raises(InputError, match=r"narrower than 1\d{3} mm, and thumb and fingers open to 1?\d{2} mm"):
        find_grasp(covering, ball(1.5, subdivisions=3))
    with pytest.raises(InputError, match="nowhere narrower than 250 mm"):
        find_grasp(covering, box(0.25, 0.25, 0.25))


def test_what_does_not_hold_is_told(covering) -> None:
    says = r"none of 6 placements ends in a grasp .* neither hand, object nor unit .* is \d+ mm wide .* to 1?\d\d mm"
    with pytest.raises(InputError, match=says):
        find_grasp(covering, ball(0.06, subdivisions=2), count=6, friction=0.01)


@pytest.mark.parametrize(
    ("thing", "friction", "says"),
    [
        (
            ball(0.008, subdivisions=2),
            0.6,
            r"the object is at fault: .* fingertip, 8.0 mm .* open from \d+ to 1?\d\d mm",
        ),
        (ball(0.003, subdivisions=2), 0.6, r"the unit is at fault, it seems: the object measures 0.003 m"),
    ],
)
def test_what_is_at_fault_is_told(covering, thing, friction: float, says: str) -> None:
    with pytest.raises(InputError, match=says):
        find_grasp(covering, thing, count=2, friction=friction)


def test_a_hand_that_cannot_close_is_at_fault(covering) -> None:
    """Joints locked open: no pad comes near another."""
    skeleton = covering.skeleton
    limits = skeleton.limits.copy()
    limits[:, FLEXION] = 0.0
    stiff = bind(replace(skeleton, limits=limits), covering.surface)
    with pytest.raises(InputError, match=r"the hand is at fault: its thumb and fingers do not close far enough"):
        find_grasp(stiff, ball(0.03, subdivisions=2), count=2)


def bowl(radius: float, wall: float):
    """Half a hollow ball, open above; its only narrow part is its wall."""
    turns = np.linspace(0.0, np.pi / 2.0, 12)
    outside, inside = ([(r * np.sin(a), -r * np.cos(a)) for a in turns] for r in (radius, radius - wall))
    return revolved([*outside, *inside[::-1]])


def revolved(profile):
    """A profile (radius, height) from axis to axis, turned about Y."""
    rings, count = np.array(profile[1:-1]), 48
    angle = 2.0 * np.pi * np.arange(count) / count
    around = np.stack([np.cos(angle), np.zeros(count), -np.sin(angle)], axis=1)
    points = rings[:, None, :1] * around + rings[:, None, 1:] * np.array([0.0, 1.0, 0.0])
    number = np.arange(len(rings) * count).reshape(-1, count)
    after = np.roll(number, -1, axis=1)
    ends = len(rings) * count + np.arange(2)[:, None] + np.zeros((1, count), dtype=int)
    faces = [
        np.stack([number[:-1], after[:-1], after[1:]], axis=-1).reshape(-1, 3),
        np.stack([number[:-1], after[1:], number[1:]], axis=-1).reshape(-1, 3),
        np.stack([ends[0], after[0], number[0]], axis=-1),
        np.stack([ends[1], number[-1], after[-1]], axis=-1),
    ]
    poles = [[0.0, profile[0][1], 0.0], [0.0, profile[-1][1], 0.0]]
    return make_object("bowl", np.concatenate([points.reshape(-1, 3), poles]), np.concatenate(faces))


def test_a_bowl_is_taken_by_its_rim(covering) -> None:
    """Wider than the hand opens: thumb on one side of the wall, fingers on the other."""
    thing = bowl(0.08, 0.004)
    assert not thing.report.notes()
    found = find_grasp(covering, thing, seed=1)
    assert found.verdict.closed
    assert found.penetration <= 6e-4
    skin = covering.deform(found.poses(covering.skeleton))[0]
    near = NearObject(thing).near(skin, 5e-4).point
    touched = near[NearObject(thing).near(skin, 5e-4).distance <= 5e-4]
    radius = np.linalg.norm(touched, axis=1)
    assert (radius > 0.079).any()
    assert (radius < 0.077).any()


def test_ways_lead_in_over_the_edges_of_a_flat_box(covering) -> None:
    """A board 3 cm thick and 30 cm wide: its middle is out of reach, and near its edges the way in is across them."""
    near, rng = NearObject(box(0.3, 0.03, 0.3)), np.random.default_rng(0)
    widths = sample_widths(near, 400, rng, widest=0.06)
    rows, ways = free_ways(near, widths, 0.07, rng)
    assert len(rows) > 20
    middle = 0.5 * (widths.first + widths.second)[rows]
    behind = middle - 0.07 * ways
    assert (np.abs(behind) > [0.15, 0.015, 0.15]).any(axis=1).all()
    assert np.abs(middle[:, [0, 2]]).max(axis=1).min() > 0.15 - 0.07
