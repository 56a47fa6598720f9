"""The measures of the benchmark of skin, on surfaces whose figures are known, and its poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.benchmarks.skin.altered import ALTERATIONS
from tests.benchmarks.skin.calibration import worse
from tests.benchmarks.skin.measures import Measuring, dihedral_angles, fold_kinds, roughness
from tests.benchmarks.skin.poses import POSES, pose
from tests.benchmarks.skin.rigs import RIGS, BenchRig, load
from warpjld.covering import Covering
from warpjld.covering.intersections import Parts, surface_parts
from warpjld.covering.quality import enclosed_volume
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, poses_from_angles, rest_poses

STRIP = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]], dtype=np.int32)
"""Two squares side by side along x, of two triangles each."""


def strip(degrees: float) -> np.ndarray:
    """Its second square turned up about their common edge."""
    angle = np.radians(degrees)
    x = np.array([0.0, 1.0, 1.0 + np.cos(angle)])
    z = np.array([0.0, 0.0, np.sin(angle)])
    return np.array([[a, y, b] for a, b in zip(x, z, strict=True) for y in (0.0, 1.0)])


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 170.0])
def test_roughness_of_a_folded_strip(degrees: float) -> None:
    """One of its three inner edges folds."""
    flat = dihedral_angles(strip(0.0), STRIP)
    assert len(flat) == 3
    folded = dihedral_angles(strip(degrees), STRIP)
    np.testing.assert_allclose(np.sort(np.degrees(folded)), [0.0, 0.0, degrees], atol=1e-6)
    assert roughness(flat, folded) == pytest.approx(degrees / np.sqrt(3.0), abs=1e-6)
    assert roughness(folded, flat) == pytest.approx(0.0, abs=1e-6)  # what flattens is no fault


def test_folds_are_told_apart(hands: dict[str, Rig]) -> None:
    parts = Parts(("left.index", "left.thumb", "left.palm"), np.array([0, 0, 1, 2, 2], dtype=np.int32))
    pairs = np.array([[0, 1], [0, 2], [1, 2], [0, 3], [3, 4]], dtype=np.int32)
    assert fold_kinds(pairs, parts, hands["left"].skeleton) == (4, 3, 2, 0)


@pytest.fixture(scope="module")
def measuring(hands: dict[str, Rig], bound: Covering) -> Measuring:
    return Measuring(BenchRig("built", hands["left"], bound, surface_parts(bound)))


def test_a_larger_hand(measuring: Measuring) -> None:
    """Twice as long in all directions about a joint: eight volumes, all edges at 2, nothing rougher, twice as thick."""
    posed = pose("index_alone", measuring.bench.rig.skeleton)
    assert posed is not None
    skeleton = measuring.bench.rig.skeleton
    still = rest_poses(skeleton)
    for joint in posed.bent:
        centre = skeleton.rest[joint]
        one = replace(posed, poses=still, bent=(joint,))
        found = measuring.measure(centre + 2.0 * (measuring.rest - centre), one)
        assert (found.volume, found.limb) == pytest.approx((700.0, 700.0), rel=1e-9)
        assert (found.least, found.low, found.high, found.largest) == pytest.approx((2.0,) * 4, rel=1e-9)
        assert (found.joint, found.digits, found.palm, found.other) == (0, 0, 0, 0)
        assert found.roughness == pytest.approx(0.0, abs=1e-4)
        assert found.thickness == pytest.approx(2.0, rel=1e-9)


def test_a_moved_hand_measures_as_at_rest(measuring: Measuring) -> None:
    skeleton = measuring.bench.rig.skeleton
    turn = Rotation.from_rotvec([0.3, 1.2, -0.7])
    zero = np.zeros((1, len(skeleton), len(CHANNELS)))
    poses = poses_from_angles(
        skeleton, zero, root_position=np.array([[1.0, 2.0, 3.0]]), root_rotation=turn.as_quat()[None]
    )
    moved = turn.apply(measuring.rest - skeleton.rest[0]) + poses.positions[0, 0]
    posed = pose("curl_06", skeleton)
    assert posed is not None
    found = measuring.measure(moved, replace(posed, poses=poses))
    assert (found.volume, found.limb, found.roughness) == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    assert (found.least, found.largest, found.thickness) == pytest.approx((1.0, 1.0, 1.0), abs=1e-6)


def test_poses_want_their_joints(hands: dict[str, Rig]) -> None:
    skeleton = hands["left"].skeleton
    assert pose("elbow_120", skeleton) is None
    assert pose("shoulder_150_side", skeleton) is None
    curled = pose("curl_06", skeleton)
    assert curled is not None
    bend = curled.poses.rotations[0, skeleton.index("left.index.tip")]
    # a finger's three joints turn about nearly one axis: 0.6 × (80 + 97 + 63) degrees
    assert np.degrees(2.0 * np.arccos(abs(bend[3]))) == pytest.approx(144.0, abs=3.0)


@pytest.mark.parametrize(
    "name", ["builtin", *(pytest.param(name, marks=pytest.mark.slow) for name in ("webxr", "godot_low"))]
)
def test_calibration_makes_no_pose_worse(name: str, measuring: Measuring) -> None:
    """Volume, folds and roughness in all poses of the benchmark, most of which are not fitted to."""
    from warpjld.covering.calibrate import calibrate

    if name != "builtin":
        bench = load(name)
        if bench is None:
            pytest.skip(f"{RIGS[name]} is not in the data folder")
        measuring = Measuring(bench)
    bench = measuring.bench
    calibrated = bench.covering.with_parameters(calibrate(bench.covering).parameters)
    complaints = []
    for pose_name in POSES:
        posed = pose(pose_name, bench.rig.skeleton)
        if posed is None:
            continue
        before, after = (measuring.measure(c.deform(posed.poses)[0], posed) for c in (bench.covering, calibrated))
        complaints += [f"{pose_name}: {text}" for text in worse(before, after)]
    assert not complaints


def test_altered_rigs_are_what_their_names_say(measuring: Measuring) -> None:
    """Of a hand without painted weights: thickness, number of triangles, length, and where the joints are."""
    bench = measuring.bench
    made = {name: ALTERATIONS[name](bench) for name in ALTERATIONS if not name.startswith("digitised")}
    assert made["as it is"] is bench.rig
    rest, faces = bench.rig.surface, len(bench.rig.surface.faces)
    volume = enclosed_volume(rest.vertices, rest.faces)
    for name, low, high in (("flesh 1.3 times as thick", 1.4, 1.75), ("flesh 0.75 times as thick", 0.5, 0.75)):
        surface = made[name].surface
        assert low < enclosed_volume(surface.vertices, surface.faces) / volume < high
    assert len(made["subdivided once"].surface.faces) == 4 * faces
    assert len(made["half of the triangles"].surface.faces) == pytest.approx(0.5 * faces, rel=0.02)
    longest = np.ptp(made["1.4 times as long"].surface.vertices, axis=0).max()
    assert longest == pytest.approx(1.4 * np.ptp(rest.vertices, axis=0).max())
    moved = np.linalg.norm(made["joints off centre by 20 %"].skeleton.rest - bench.rig.skeleton.rest, axis=1)
    twice = np.linalg.norm(made["joints off centre by 40 %"].skeleton.rest - bench.rig.skeleton.rest, axis=1)
    np.testing.assert_allclose(twice, 2.0 * moved)
    assert moved.max() > 1e-3
