"""What must hold for every rig and both methods: rest, rigid motion, mirror images, locality, and the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from tests.covering.poses import random_angles, random_poses
from warpjld.covering import Covering, bind
from warpjld.covering.binding import STATIONS
from warpjld.covering.paper import PaperCovering
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_angles, rest_poses

Method = Literal["smooth", "paper"]
REST = 1e-6  # m
FILES = {
    "webxr left": "hand_webxr_generic/left.glb",
    "webxr right": "hand_webxr_generic/right.glb",
    "anny left": "hand_anny/left.glb",
    "body": "body_anny/body_lowpoly_163joints.glb",
}


@pytest.fixture(scope="session")
def coverings() -> dict[str, Covering]:
    return {}


@pytest.fixture(params=["built", *FILES])
def rig_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=["smooth", "paper"])
def covering(request: pytest.FixtureRequest, rig_name: str, built: Rig, coverings: dict[str, Covering]) -> Covering:
    """Every rig, bound by both methods, once."""
    method: Method = request.param
    key = f"{rig_name} {method}"
    if key not in coverings:
        rig = built
        if rig_name in FILES:
            data: Path = request.getfixturevalue("data")
            rig = load_rig(data / FILES[rig_name])
        coverings[key] = bind(rig.skeleton, rig.surface, method=method)
    return coverings[key]


def reach(covering: Covering) -> float:
    """What float32 rounding is relative to: how far from the origin vertices lie, moved by half a metre."""
    return float(np.abs(covering.surface.vertices).max()) + covering.surface.size + 0.5


def test_rest_pose_is_returned(covering: Covering) -> None:
    moved = covering.deform(rest_poses(covering.skeleton, 2))
    assert np.abs(moved - covering.surface.vertices).max() < REST


def test_root_motion_is_rigid(covering: Covering) -> None:
    skeleton = covering.skeleton
    angles = random_angles(skeleton, 3, 21)
    rng = np.random.default_rng(22)
    turn, shift = Rotation.random(3, rng=rng), rng.uniform(-0.5, 0.5, (3, 3))
    still = covering.deform(poses_from_angles(skeleton, angles)).astype(np.float64)
    moved = covering.deform(poses_from_angles(skeleton, angles, root_position=shift, root_rotation=turn.as_quat()))
    root = skeleton.rest[0]
    for f in range(3):
        wanted = turn[f].apply(still[f] - root) + root + shift[f]
        assert np.abs(moved[f] - wanted).max() < 1e-6 * reach(covering)


def test_points_are_the_deformation(covering: Covering) -> None:
    poses = random_poses(covering.skeleton, 3, 31)
    some = np.random.default_rng(32).integers(0, len(covering.surface.vertices), 50)
    difference = covering.points(poses, some) - covering.deform(poses)[:, some]
    assert np.abs(difference).max() < 5e-7 * reach(covering)


def test_threads_blocks_and_batches_give_the_same_bits(covering: Covering) -> None:
    poses = random_poses(covering.skeleton, 7, 41)
    whole = covering.deform(poses, threads=1)
    np.testing.assert_array_equal(covering.deform(poses, threads=2), whole)
    for start, block in covering.blocks(poses, frames=3):
        np.testing.assert_array_equal(block, whole[start : start + len(block)])
    for f in range(len(poses)):
        np.testing.assert_array_equal(covering.deform(poses[f : f + 1])[0], whole[f])
    ordered = covering.deform(poses, order="runs")
    moved_back = covering.run_surface.faces
    np.testing.assert_array_equal(ordered[:, moved_back], whole[:, covering.surface.faces])


@pytest.mark.parametrize("field", ["positions", "rotations", "flexion"])
def test_poses_that_are_not_finite_are_refused(bound: Covering, field: str) -> None:
    poses = random_poses(bound.skeleton, 2, 51)
    getattr(poses, field)[1, 4] = np.nan
    with pytest.raises(InputError, match=f"'{bound.skeleton.names[4]}' is not finite at frame 1"):
        bound.deform(poses)
    with pytest.raises(InputError, match="not finite"):
        bound.points(poses, [0])


@pytest.mark.parametrize("method", ["smooth", "paper"])
def test_hands_mirror_each_other(hands: dict[str, Rig], built: Rig, method: Method) -> None:
    right = hands["right"]
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(right.surface.vertices * mirror, built.surface.vertices, atol=1e-12)
    moved = []
    for rig in (built, right):
        angles = random_angles(rig.skeleton, 4, 61)
        moved.append(bind(rig.skeleton, rig.surface, method=method).deform(poses_from_angles(rig.skeleton, angles)))
    difference = np.abs(moved[1] * mirror - moved[0]).max(axis=(0, 2))
    assert difference.max() < REST


def test_a_joint_moves_what_depends_on_it(covering: Covering) -> None:
    """Vertices none of whose joints moved keep their bits; those whose joints all moved together move rigidly."""
    skeleton = covering.skeleton
    base = random_angles(skeleton, 1, 71)
    before = poses_from_angles(skeleton, base)
    kept = covering.deform(before)[0]
    seen = {"still": 0, "rigid": 0, "bent": 0}
    bendable = [j for j in range(len(skeleton)) if skeleton.children[j] and skeleton.parents[j] >= 0]
    for joint in bendable[:: max(1, len(bendable) // 12)]:
        angles = base.copy()
        angles[0, joint, 0] += 0.3
        after = poses_from_angles(skeleton, angles)
        moved = covering.deform(after)[0]
        still, rigid = untouched(covering, joint)
        np.testing.assert_array_equal(moved[still], kept[still])
        turn = Rotation.from_quat(after.rotations[0, joint]) * Rotation.from_quat(before.rotations[0, joint]).inv()
        pivot = before.positions[0, joint]
        wanted = turn.apply(kept[rigid] - pivot) + pivot
        assert np.abs(moved[rigid] - wanted).max(initial=0.0) < 1e-6 * reach(covering)
        rest = ~still & ~rigid
        seen["still"] += int(still.sum())
        seen["rigid"] += int(rigid.sum())
        seen["bent"] += int((np.abs(moved[rest] - kept[rest]).max(axis=1) > 1e-5).sum())
    assert min(seen.values()) > 0, seen


def untouched(covering: Covering, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that do not depend on a joint or anything it carries, and those that depend on what it carries only."""
    skeleton = covering.skeleton
    below = np.zeros(len(skeleton), dtype=bool)
    for j in range(joint + 1, len(skeleton)):
        parent = skeleton.parents[j]
        below[j] = parent == joint or below[parent]
    ends = covering.anchors.ends
    # a segment sees where its joints are, how its bone is turned, and its neighbours at both joints
    proximal, distal = ends.T
    changed = (proximal == joint) | (distal == joint) | below[proximal] | below[distal]
    carried = below[proximal] & below[distal]
    if not isinstance(covering, PaperCovering):
        return of_rows(covering, joint, below, changed, carried)
    places = covering.places
    segment = places.segment
    used = np.column_stack([np.ones(len(places.between), dtype=bool), places.between])
    still = ~(used & changed[segment]).any(axis=1)
    rigid = (~used | carried[segment]).all(axis=1)
    return still, rigid


def of_rows(
    covering: Covering, joint: int, below: np.ndarray, changed: np.ndarray, carried: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The same of the smooth method, by what the coefficients of a vertex read."""
    rows, parents, pairs = covering.rows, covering.skeleton.parents, covering.anchors.pairs
    own = below.copy()
    own[joint] = True  # its bone turns; the joint itself stays where it is
    halfway = own | own[np.maximum(parents, 0)]
    beside = changed[pairs].any(axis=1) if len(pairs) else np.zeros(0, dtype=bool)
    moving = np.concatenate([below, halfway, own, own, np.repeat(beside, STATIONS), changed])
    together = np.concatenate(
        [below | (np.arange(len(own)) == joint), own & own[np.maximum(parents, 0)] & (parents >= 0), own]
    )
    inputs = sp.hstack([rows.positions, rows.turns, rows.scales, rows.muscles], format="csr")
    still = (abs(inputs) @ moving.astype(np.float64)) == 0.0
    # what only follows: positions and rotations carried along, and nothing that swells where a bend changes
    swelling = abs(sp.hstack([rows.scales, rows.muscles], format="csr"))
    swells = np.concatenate([own, np.repeat(beside, STATIONS), changed])
    swells[: len(own)] = np.arange(len(own)) == joint
    swells[len(own) + STATIONS * len(pairs) :] = (covering.anchors.ends == joint).any(axis=1)
    frame = abs(sp.hstack([rows.positions, rows.turns], format="csr"))
    rigid = ((frame @ (~together).astype(np.float64)) == 0.0) & ((swelling @ swells.astype(np.float64)) == 0.0)
    return still, rigid
