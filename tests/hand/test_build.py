"""The built-in hand measured from outside: closed, of the size asked for, its joints where they belong."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests.hand.measuring import centroid_and_radius, loops, self_intersections
from warpjld.errors import InputError
from warpjld.hand import build_hand
from warpjld.rig import Rig
from warpjld.skeleton import DIGITS, PAPER_NUMBERS, poses_from_angles

LENGTH, BREADTH = 0.19, 0.085
HEADS = 0.42  # of the length, from the wrist: where breadth is measured
FINGERS = ("index", "middle", "ring", "pinky")
OUTWARD = np.array([0.0, 0.0, -1.0])
SIZE_TOLERANCE = 0.01  # of length and breadth: a coarse mesh cuts corners of its smooth surface


@pytest.fixture(scope="module")
def hand() -> Rig:
    return build_hand()


@pytest.fixture(scope="module")
def coarse() -> Rig:
    return build_hand(resolution=2000)


def breadth_of(rig: Rig, length: float) -> float:
    outlines = loops(rig.surface.vertices, rig.surface.faces, HEADS * length * OUTWARD, OUTWARD)
    return max(float(np.ptp(outline[:, 0])) for outline in outlines)


def check_closed(rig: Rig) -> None:
    vertices, faces = mesh_of(rig)
    start, end = faces.T.ravel().astype(np.int64), np.roll(faces, -1, axis=1).T.ravel()
    there, back = np.sort(start * len(vertices) + end), np.sort(end * np.int64(len(vertices)) + start)
    assert (np.diff(there) > 0).all(), "no edge may be run through twice the same way"
    assert (there == back).all(), "every edge is run through both ways: closed and consistently oriented"
    assert len(vertices) - len(start) // 2 + len(faces) == 2, "want the topology of a sphere"
    links = coo_array((np.ones(len(start)), (start, end)), shape=(len(vertices),) * 2)
    assert connected_components(links, directed=False)[0] == 1
    a, b, c = vertices[faces.T]
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0, "faces must look outward"
    assert len(rig.surface.weld) == len(rig.surface.vertices), "nothing to weld"


@pytest.mark.parametrize("resolution", [5_000, 40_000, pytest.param(300_000, marks=pytest.mark.slow)])
def test_closed_and_as_many_vertices_as_asked(resolution: int) -> None:
    rig = build_hand(resolution=resolution)
    check_closed(rig)
    assert len(rig.surface.vertices) == pytest.approx(resolution, rel=0.05)


@pytest.mark.slow
def test_a_million_vertices() -> None:
    rig = build_hand(resolution=1_000_000)
    check_closed(rig)
    assert len(rig.surface.vertices) == pytest.approx(1_000_000, rel=0.05)


def test_triangles_are_well_shaped(hand: Rig, coarse: Rig) -> None:
    for rig in (hand, coarse):
        angles = np.degrees(trimesh.Trimesh(rig.surface.vertices, rig.surface.faces, process=False).face_angles)
        smallest = angles.min(axis=1)
        assert smallest.min() > 15.0
        assert np.percentile(smallest, 1) > 30.0
        assert angles.max() < 140.0


def test_no_triangle_crosses_another(hand: Rig, coarse: Rig) -> None:
    assert self_intersections(hand.surface.vertices, hand.surface.faces) == 0
    assert self_intersections(coarse.surface.vertices, coarse.surface.faces) == 0


def test_the_crossing_check_sees_a_crossing(coarse: Rig) -> None:
    vertices = coarse.surface.vertices.copy()
    finger = np.abs(vertices - coarse.skeleton.rest[coarse.skeleton.index("middle.knuckle2")]).max(axis=1) < 0.02
    vertices[np.argmax(np.where(finger, vertices[:, 1], -1.0)), 1] -= 0.03  # from the back through the pulp
    assert self_intersections(vertices, coarse.surface.faces) > 0


def test_volume_of_hand_and_stub(hand: Rig) -> None:
    volume = trimesh.Trimesh(hand.surface.vertices, hand.surface.faces, process=False).volume
    assert 350e-6 < volume < 450e-6


@pytest.mark.parametrize(("length", "ratio"), [(0.15, 0.50), pytest.param(0.23, 0.39, marks=pytest.mark.slow)])
def test_length_and_breadth_as_asked(length: float, ratio: float) -> None:
    rig = build_hand(length=length, breadth=ratio * length, resolution=2000)
    assert -rig.surface.vertices[:, 2].min() == pytest.approx(length, rel=SIZE_TOLERANCE)
    assert breadth_of(rig, length) == pytest.approx(ratio * length, rel=SIZE_TOLERANCE)


def test_fingers_are_apart(coarse: Rig) -> None:
    outlines = loops(coarse.surface.vertices, coarse.surface.faces, 0.68 * LENGTH * OUTWARD, OUTWARD)
    assert len(outlines) == 4
    spans = sorted((outline[:, 0].min(), outline[:, 0].max()) for outline in outlines)
    gaps = [right[0] - left[1] for left, right in pairwise(spans)]
    assert min(gaps) > 0.0015


def test_finger_proportions(hand: Rig) -> None:
    reach = {digit: -hand.skeleton.rest[hand.skeleton.index(f"{digit}.tip"), 2] for digit in FINGERS}
    assert reach["middle"] > max(reach["index"], reach["ring"])
    assert min(reach["index"], reach["ring"]) > reach["pinky"]
    ulnar = hand.surface.vertices[:, 0] < 0.5 * sum(
        hand.skeleton.rest[hand.skeleton.index(f"{digit}.knuckle3"), 0] for digit in ("ring", "pinky")
    )
    end = -hand.surface.vertices[ulnar, 2].min()
    last = -hand.skeleton.rest[hand.skeleton.index("ring.knuckle3"), 2]
    assert abs(end - last) < 0.05 * LENGTH, "the pinky ends near the ring's last joint"


@pytest.mark.parametrize("digit", DIGITS)
def test_joints_are_centres_of_the_sections(hand: Rig, digit: str) -> None:
    skeleton = hand.skeleton
    joints = [skeleton.index(f"{digit}.{name}") for name in ("base", "knuckle2", "knuckle3", "tip")]
    # the thumb's second joint lies in the palm's flesh, as the fingers' bases do
    for k in range(2 if digit == "thumb" else 1, 4):
        before, at = skeleton.rest[joints[k - 1]], skeleton.rest[joints[k]]
        normal = (at - before) / np.linalg.norm(at - before)
        if k < 3:
            after = skeleton.rest[joints[k + 1]]
            normal = normal + (after - at) / np.linalg.norm(after - at)
        sections = [centroid_and_radius(o, normal) for o in loops(*mesh_of(hand), at, normal)]
        offsets = [np.linalg.norm(centre - at) / radius for centre, radius in sections]
        assert min(offsets) < (0.06 if k == 3 else 0.01)


@pytest.mark.parametrize("joint", ["wrist", "forearm"])
def test_wrist_and_forearm_are_centres_of_the_sections(hand: Rig, joint: str) -> None:
    at = hand.skeleton.rest[hand.skeleton.index(joint)]
    ((centre, radius),) = [centroid_and_radius(o, OUTWARD) for o in loops(*mesh_of(hand), at, OUTWARD)]
    assert np.linalg.norm(centre - at) < 0.01 * radius


def test_every_joint_is_well_inside(hand: Rig) -> None:
    mesh = trimesh.Trimesh(hand.surface.vertices, hand.surface.faces, process=False)
    corners = mesh.triangles[None] - hand.skeleton.rest[:, None, None]
    a, b, c = np.moveaxis(corners, 2, 0)
    la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    dot = np.einsum
    solid = np.arctan2(
        dot("jtk,jtk->jt", a, np.cross(b, c)),
        la * lb * lc + dot("jtk,jtk->jt", a, b) * lc + dot("jtk,jtk->jt", b, c) * la + dot("jtk,jtk->jt", c, a) * lb,
    )
    np.testing.assert_allclose(solid.sum(axis=1) / (2.0 * np.pi), 1.0, atol=1e-6)
    depth = np.linalg.norm(mesh.vertices[None] - hand.skeleton.rest[:, None], axis=2).min(axis=1)
    assert depth.min() > 0.0035


def test_the_papers_joints_are_there(hand: Rig) -> None:
    assert hand.skeleton.names[0] == "left.forearm"
    assert len(hand.skeleton) == 26
    for name in PAPER_NUMBERS.values():
        hand.skeleton.index(name)
    (palm,) = hand.skeleton.palms
    assert [hand.skeleton.names[distal] for _, distal in palm] == [
        "left.pinky.base", "left.ring.base", "left.middle.base", "left.index.base", "left.thumb.knuckle2"
    ]  # fmt: skip


def test_axes_are_square_to_their_bones_and_bend_towards_the_palm(hand: Rig) -> None:
    skeleton = hand.skeleton
    np.testing.assert_allclose(np.linalg.norm(skeleton.axes, axis=1), 1.0, atol=1e-12)
    for digit in DIGITS:
        for name in ("base", "knuckle2", "knuckle3"):
            j = skeleton.index(f"{digit}.{name}")
            assert abs(skeleton.axes[j] @ skeleton.directions[j]) < 1e-9
            angles = np.zeros((1, len(skeleton), 4))
            angles[0, j, 0] = 0.3
            tip = skeleton.index(f"{digit}.tip")
            moved = poses_from_angles(skeleton, angles).positions[0, tip] - skeleton.rest[tip]
            if digit == "thumb":
                assert moved[0] < 0.0, "a left thumb closes across the palm, towards -x"
            else:
                assert moved[1] < 0.0


def test_right_is_the_mirror_image_of_left(coarse: Rig) -> None:
    right = build_hand("right", resolution=2000)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_array_equal(right.surface.vertices, coarse.surface.vertices * mirror)
    np.testing.assert_array_equal(right.surface.faces, coarse.surface.faces[:, ::-1])
    np.testing.assert_array_equal(right.skeleton.rest, coarse.skeleton.rest * mirror)
    assert right.skeleton.names == tuple(n.replace("left.", "right.") for n in coarse.skeleton.names)
    check_closed(right)
    angles = np.zeros((1, 26, 4))
    angles[0, :, 0] = 0.4
    angles[0, :, 3] = 0.2
    both = [poses_from_angles(rig.skeleton, angles).positions for rig in (coarse, right)]
    np.testing.assert_allclose(both[0] * mirror, both[1], atol=1e-12)


def test_same_bits_every_time(coarse: Rig) -> None:
    again = build_hand(resolution=2000)
    np.testing.assert_array_equal(again.surface.vertices, coarse.surface.vertices)
    np.testing.assert_array_equal(again.surface.faces, coarse.surface.faces)


@pytest.mark.parametrize("digit", [pytest.param("index", marks=pytest.mark.slow), "thumb"])
def test_proportions_lengthen_and_thicken_one_digit(digit: str, coarse: Rig) -> None:
    other = build_hand(resolution=2000, proportions={digit: (1.2, 1.15)})
    chain = [coarse.skeleton.index(f"{digit}.{name}") for name in ("base", "knuckle2", "knuckle3")]
    before, after = (np.linalg.norm(np.diff(r.skeleton.rest[chain], axis=0), axis=1) for r in (coarse, other))
    np.testing.assert_allclose(after, 1.2 * before, rtol=0.01)
    assert section_at(other, digit) == pytest.approx(1.15 * section_at(coarse, digit), rel=0.03)
    assert section_at(other, "ring") == pytest.approx(section_at(coarse, "ring"), rel=0.03)


def section_at(rig: Rig, digit: str) -> float:
    at, end = (rig.skeleton.rest[rig.skeleton.index(f"{digit}.{name}")] for name in ("knuckle3", "tip"))
    sections = [centroid_and_radius(o, end - at) for o in loops(*mesh_of(rig), at, end - at)]
    return min(sections, key=lambda s: float(np.linalg.norm(s[0] - at)))[1]


def mesh_of(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    return rig.surface.vertices, rig.surface.faces


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"side": "both"}, "side: want 'left' or 'right', got 'both'"),
        ({"length": 190.0}, "length: want metres"),
        ({"length": float("nan")}, "length: want metres"),
        ({"breadth": 0.03}, "breadth: want metres, 0.061…0.118"),
        ({"resolution": 10}, "resolution: want a number of vertices"),
        ({"proportions": {"indx": 1.1}}, "did you mean index"),
        ({"proportions": {"index": 4.0}}, "proportions of 'index': want a length"),
    ],
)
def test_bad_arguments_are_named(arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build_hand(**arguments)
