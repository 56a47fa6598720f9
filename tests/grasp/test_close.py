"""Closing a hand: skin touches, nothing goes through the object or other digits; intersections and contacts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.errors import InputError
from warpjld.grasp import Places, SearchStatus
from warpjld.grasp.close import Closer
from warpjld.grasp.digits import digit_chains, pad_vertex
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.intersection import contacts, intersection, part_vertices
from warpjld.grasp.keep_apart import keep_apart
from warpjld.grasp.posed_skins import PosedSkins
from warpjld.grasp.shapes import ball, box, cylinder
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

ENTERS = 2.5e-5  # metres: twice the tolerance of a touch, and rounding
PRESSED = 6e-4  # metres that an edge may stay in the skin between its vertices; a neighbour that opens adds a little
CHANNEL = {name: k for k, name in enumerate(CHANNELS)}


@pytest.fixture(scope="module")
def open_hand(covering):
    """Fingers spread, thumb opposed; angles (1, J, 4)."""
    angles = np.zeros((1, len(covering.skeleton), len(CHANNELS)))
    for joint, channel, degrees in (
        ("index.base", "abduction", 10),
        ("ring.base", "abduction", -8),
        ("pinky.base", "abduction", -18),
        ("thumb.base", "pivot", 30),
        ("thumb.base", "abduction", 20),
        ("thumb.base", "flexion", -10),
    ):
        angles[0, covering.skeleton.index(joint), CHANNEL[channel]] = np.radians(degrees)
    return poses_from_angles(covering.skeleton, angles), angles


def below_the_palm(covering, poses, thing) -> Places:
    """Straight under the knuckles, just clear of the skin, from both sides."""
    skin, both = covering.deform(poses)[0], HandObjectGaps(covering, thing)
    under = np.array([0.004, 0.0, -0.062])
    low, high = 0.0, 0.3
    for _ in range(16):
        middle = (low + high) / 2
        near = both.gaps(skin[None], Places.of(under - [0, middle, 0])).min() < 2e-4
        low, high = (middle, high) if near else (low, middle)
    return Places.of(under - [0, high, 0])


@pytest.mark.parametrize(
    ("make", "coupling"),
    [
        (lambda: ball(0.065), None),
        (lambda: cylinder(0.05, 0.2), (1.0, 0.7)),
        (lambda: box(0.05, 0.05, 0.05), None),
        (lambda: box(0.05, 0.05, 0.05), (1.0, 0.7)),
    ],
)
def test_digits_touch_and_do_not_enter(covering, open_hand, make, coupling) -> None:
    poses, angles = open_hand
    thing = make()
    place = below_the_palm(covering, poses, thing)
    closed = Closer(covering, thing).close(poses, angles, places=place, coupling=coupling, apart=False)
    assert closed.touching().sum() >= 4
    assert closed.penetration[0] <= PRESSED
    skin = covering.deform(poses_from_angles(covering.skeleton, closed.angles))[0]
    inside = intersection(covering, skin, thing, place=place)
    assert inside.deepest < ENTERS
    assert HandObjectGaps(covering, thing).depths(skin[None], place).max() <= PRESSED
    touched = {c.part for c in contacts(covering, skin, thing, place=place)}
    digits = {name for name, touch in zip(closed.digits, closed.touching()[0], strict=True) if touch}
    assert digits <= touched
    others = np.delete(closed.angles, CHANNEL["flexion"], axis=2)
    np.testing.assert_array_equal(others, np.delete(angles, CHANNEL["flexion"], axis=2))
    low, high = np.moveaxis(covering.skeleton.limits[:, 0], -1, 0)
    assert ((closed.angles[0, :, 0] >= low - 1e-9) & (closed.angles[0, :, 0] <= high + 1e-9)).all()


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda: ball(0.065, subdivisions=3), id="ball"),
        pytest.param(lambda: box(0.05, 0.07, 0.03), id="box", marks=pytest.mark.slow),
    ],
)
def test_batches_are_single_hands(covering, open_hand, make) -> None:
    """Bit for bit, whatever a hand is closed beside, and whatever the closer closed before."""
    poses, angles = open_hand
    thing = make()
    (under,) = below_the_palm(covering, poses, thing).position
    places = Places.of(under + np.array([[0, 0, 0], [0.003, -0.001, 0.004], [-0.005, -0.002, 0], [0, 5, 0]]))
    several = Poses(*(np.repeat(a, 4, axis=0) for a in (poses.positions, poses.rotations, poses.flexion)))
    how = {"coupling": (1.0, 0.7)}
    closer = Closer(covering, thing)
    together = closer.close(several, np.repeat(angles, 4, axis=0), places=places, **how)
    for k in (2, 0, 3, 1):
        for fresh in (closer, Closer(covering, thing)):
            alone = fresh.close(poses, angles, places=places[k], **how)
            for name in ("angles", "status", "gap", "penetration"):
                np.testing.assert_array_equal(getattr(alone, name)[0], getattr(together, name)[k])
    loose = closer.close(several, np.repeat(angles, 4, axis=0), places=places, apart=False, **how)
    parted = closer.parted(several, np.repeat(angles, 4, axis=0), loose, places=places)
    np.testing.assert_array_equal(parted.angles, together.angles)
    np.testing.assert_array_equal(parted.status, together.status)


def test_nothing_to_touch_closes_to_the_limits(covering, open_hand) -> None:
    poses, angles = open_hand
    far = ball(0.05).placed((0, 5, 0))
    closed = Closer(covering, far).close(poses, angles, digits=["index"], apart=False)
    assert (closed.status == SearchStatus.NO_CONTACT).all()
    joints = list(digit_chains(covering.skeleton, ["index"])["left.index"])
    np.testing.assert_allclose(closed.angles[0, joints, 0], covering.skeleton.limits[joints, 0, 1])


def test_a_digit_that_begins_inside_is_told(covering, open_hand) -> None:
    poses, angles = open_hand
    tip = poses.positions[0, covering.skeleton.index("ring.tip")]
    closed = Closer(covering, ball(0.03).placed(tip)).close(poses, angles, digits=["ring"], apart=False)
    assert closed.status[0, 0, 0] == SearchStatus.INSIDE
    assert closed.penetration[0] > 5e-3


def test_digits_do_not_pass_through_one_another(covering) -> None:
    """The index is sent across the middle finger by its abduction: its flexion must stop before."""
    skeleton = covering.skeleton
    chains = digit_chains(skeleton)
    start = np.zeros((len(skeleton), len(CHANNELS)))
    closed = start.copy()
    for name, joints in chains.items():
        closed[list(joints), 0] = skeleton.limits[list(joints), 0, 1] * (0.9 if "thumb" in name else 0.75)
    closed[skeleton.index("thumb.base"), 0] = skeleton.limits[skeleton.index("thumb.base"), 0, 1]
    start[skeleton.index("thumb.base"), 1] = closed[skeleton.index("thumb.base"), 1] = np.radians(45)
    parts = surface_parts(covering)

    def between(angles) -> int:
        skin = covering.deform(poses_from_angles(skeleton, angles[None]))[0]
        return len(crossing_faces(skin, covering.surface.faces).contact(parts).pairs)

    assert between(start) == 0
    assert between(closed) > 0

    def deformed(hands, angles):
        return covering.deform(poses_from_angles(skeleton, angles))

    apart, gone = keep_apart(PosedSkins(covering), deformed, start[None], closed[None], chains)
    assert (gone < 1.0).any()
    assert between(apart[0]) == 0


def test_the_volume_of_a_known_overlap(covering) -> None:
    """A ball around the tip of a finger, and the same finger as a solid: half-spaces cut from a box."""
    skin = covering.surface.vertices
    whole = box(*(np.ptp(skin, axis=0) + 0.02)).placed((skin.min(axis=0) + skin.max(axis=0)) / 2)
    found = intersection(covering, skin.astype(np.float32), whole, spacing=2e-3)
    assert len(found.vertices) == len(skin)
    from warpjld.covering.quality import enclosed_volume

    assert found.volume == pytest.approx(float(enclosed_volume(skin, covering.surface.faces)), rel=0.01)
    assert "vertices inside, deepest" in str(found)
    index = intersection(covering, skin.astype(np.float32), whole, part="index", spacing=2e-3)
    assert 0.03 < index.volume / found.volume < 0.12
    assert set(index.vertices) == set(part_vertices(covering, "index"))
    nothing = intersection(covering, skin.astype(np.float32), ball().placed((1, 1, 1)))
    assert (len(nothing.vertices), nothing.volume, str(nothing)) == (0, 0.0, "no vertex inside")


def test_parts_by_name(covering) -> None:
    last = part_vertices(covering, "index.knuckle3")
    assert set(last) < set(part_vertices(covering, "left.index")) == set(part_vertices(covering, "INDEX"))
    assert pad_vertex(covering, "index") in last
    assert set(part_vertices(covering, "left.hand")) > set(part_vertices(covering, "index"))  # as anatomy calls it
    assert len(part_vertices(covering, None)) == len(covering.surface.vertices)
    with pytest.raises(InputError, match="did you mean index"):
        part_vertices(covering, "indx")
    with pytest.raises(InputError, match="no digit 'toe'"):
        digit_chains(covering.skeleton, ["toe"])


def test_a_digit_without_skin_at_its_end_is_named(covering) -> None:
    ends = covering.anchors.ends.copy()
    ends[ends[:, 0] == covering.skeleton.index("index.knuckle3"), 0] = 0
    bare = SimpleNamespace(skeleton=covering.skeleton, anchors=replace(covering.anchors, ends=ends))
    with pytest.raises(InputError, match="no skin belongs to the last segment of 'index'"):
        pad_vertex(bare, "index")


def test_the_pad_lies_on_the_palms_side(covering) -> None:
    for digit in ("index", "middle", "ring", "pinky"):
        pad = covering.surface.vertices[pad_vertex(covering, digit)]
        bone = covering.skeleton.rest[covering.skeleton.index(f"{digit}.knuckle3")]
        assert pad[1] < bone[1] - 0.003  # the palm looks down
