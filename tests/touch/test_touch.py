"""Skin that crosses, on two spheres whose overlap is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from warpjld.covering.intersections import crossing_faces
from warpjld.covering.quality import enclosed_volume
from warpjld.errors import InputError
from warpjld.touch.patches import patches
from warpjld.touch.touch import Touch

RADIUS = 0.01
COUNT = 1500

AWAY = np.array([0.3, 0.1, -0.2])


def ball() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Points of a Fibonacci lattice on a sphere, and their hull, turned outwards."""
    k = np.arange(COUNT) + 0.5
    z, angle = 1.0 - 2.0 * k / COUNT, np.pi * (1.0 + 5.0**0.5) * k
    flat = np.sqrt(1.0 - z * z)
    points = np.column_stack([z, flat * np.cos(angle), flat * np.sin(angle)])
    faces = ConvexHull(points).simplices.astype(np.int32)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return RADIUS * points, faces


BALL, FACES = ball()
BOTH = np.concatenate([FACES, FACES + COUNT])
PART = np.repeat([0, 1], COUNT).astype(np.int32)


def pair(overlap: float) -> NDArray[np.float64]:
    """Two mirror images that overlap by so much along x [m], shape (2 COUNT, 3)."""
    left = BALL * [-1.0, 1.0, 1.0] - [RADIUS - overlap / 2.0, 0.0, 0.0]
    return np.concatenate([left, left * [-1.0, 1.0, 1.0]])


def contact(give: NDArray[np.float64] | None = None, thickness: float = RADIUS) -> Touch:
    # the left one is a mirror image: its triangles run the other way round
    faces = np.concatenate([FACES[:, ::-1], FACES + COUNT])
    thick = np.full(2 * COUNT, thickness)
    return Touch(patches(faces, PART, ("left", "right"), thick, give), pair(-RADIUS))


TOUCH = contact()


def part(points: NDArray[np.float64], touch: Touch = TOUCH) -> NDArray[np.float64]:
    return np.asarray(touch.apply(points[None])[0][0])


def test_what_crosses_is_parted_and_both_sides_give_the_same() -> None:
    before = pair(0.2 * RADIUS)
    after = part(before)
    faces = TOUCH.patches.faces
    assert len(crossing_faces(before, faces).faces) > 20
    assert not len(crossing_faces(after, faces).faces)
    shift = after - before
    assert shift[:COUNT, 0].min() == pytest.approx(-0.1 * RADIUS, rel=0.4), "half of the overlap each, and clearance"
    np.testing.assert_allclose(shift[:COUNT] * [-1.0, 1.0, 1.0], shift[COUNT:], atol=1e-3 * RADIUS)


def test_volume_is_kept() -> None:
    before, faces = pair(0.2 * RADIUS), TOUCH.patches.faces
    after = part(before)
    for some in (faces[: len(FACES)], faces[len(FACES) :]):
        rest = enclosed_volume(before, some)
        lost = 3.0 * 0.25 * np.pi * (0.1 * RADIUS) ** 2 * RADIUS / rest  # of the order of the cap that went
        assert enclosed_volume(after, some) == pytest.approx(rest, rel=min(0.5 * lost, 0.005))


def test_what_is_far_or_does_not_overlap_stays_bit_for_bit() -> None:
    apart = pair(-0.01 * RADIUS)
    np.testing.assert_array_equal(part(apart), apart)
    before = pair(0.2 * RADIUS)
    far = np.abs(before[:, 0]) > 1.6 * RADIUS
    assert far.sum() > 300
    np.testing.assert_array_equal(part(before)[far], before[far])


def test_displacement_goes_to_nothing_with_the_overlap() -> None:
    sizes = [np.abs(part(pair(d * RADIUS)) - pair(d * RADIUS)).max() / RADIUS for d in (0.1, 0.03, 0.01, 0.003)]
    assert all(a > b for a, b in pairwise(sizes))
    assert sizes[-1] < 0.01
    steps = [part(pair(d * RADIUS)) for d in np.linspace(0.1, 0.12, 21)]
    moved = [np.abs(b - a).max() for a, b in pairwise(steps)]
    assert max(moved) < 0.02 * RADIUS, "a thousandth of the radius a step moves nothing by leaps"


def test_a_stiff_side_does_not_give_way() -> None:
    give = np.concatenate([np.zeros(COUNT), np.ones(COUNT)])
    before = pair(0.15 * RADIUS)
    after = part(before, contact(give))
    np.testing.assert_array_equal(after[:COUNT], before[:COUNT])
    assert (after - before)[COUNT:, 0].max() > 0.1 * RADIUS


def test_turned_and_carried_away_it_is_the_same() -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    before = pair(0.2 * RADIUS)
    expected = turn.apply(part(before)) + AWAY
    np.testing.assert_allclose(part(turn.apply(before) + AWAY), expected, atol=2e-3 * RADIUS)


def test_what_is_too_deep_is_told() -> None:
    told = TOUCH.apply(pair(0.9 * RADIUS)[None], first=7)[1]
    assert {(one.part, one.other, one.frame) for one in told} == {("left", "right", 7), ("right", "left", 7)}
    assert all(0.85 * RADIUS < one.depth < 0.95 * RADIUS for one in told)
    assert not TOUCH.apply(pair(0.2 * RADIUS)[None])[1]


def test_what_is_told_of_a_pose_that_nobody_can_take_is_nearly_its_deepest() -> None:
    """Parting asks only some vertices there, measuring all of them."""
    touch = contact(thickness=0.5 * RADIUS)
    for overlap in (0.6, 0.75, 0.9):
        points = pair(overlap * RADIUS)[None]
        some, every = touch.parted(points)[1][0], touch.measured(points)[0]
        assert len(some.vertex) < 0.5 * len(every.vertex)
        assert 0.9 * every.depth.max() < some.depth.max() <= every.depth.max()


def test_a_frame_does_not_follow_from_those_before() -> None:
    frames = np.stack([pair(d * RADIUS) for d in (0.9, 0.2, 1.2, 0.3)])
    together, told = TOUCH.apply(frames)
    for k, frame in enumerate(frames):
        alone, of_it = TOUCH.apply(frame[None], first=k)
        np.testing.assert_array_equal(alone[0], together[k])
        assert of_it == [one for one in told if one.frame == k]


def test_surfaces_of_so_few_vertices_that_all_are_tested_at_once_are_parted() -> None:
    count = 12
    few = ConvexHull(BALL[:: COUNT // count][:count]).points
    faces = ConvexHull(few).simplices.astype(np.int32)
    a, b, c = (few[faces[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * (a - few.mean(axis=0))).sum(axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    along = np.array([1.0, 0.0, 0.0])
    left, right = few - few[:, 0].max() * along, few * [-1.0, 1.0, 1.0] + few[:, 0].max() * along
    both = np.concatenate([faces, faces[:, ::-1] + count])
    apart = np.concatenate([left - RADIUS * along, right + RADIUS * along])
    own = np.repeat([0, 1], count).astype(np.int32)
    touch = Touch(patches(both, own, ("left", "right"), np.full(2 * count, RADIUS), None), apart)
    overlapping = np.concatenate([left + RADIUS / 8.0 * along, right - RADIUS / 8.0 * along])
    parted = np.asarray(touch.apply(overlapping[None])[0][0])
    assert np.isfinite(parted).all()
    assert parted[:count, 0].max() < overlapping[:count, 0].max() - 1e-4


def test_refuses_points_of_another_surface_and_negative_compliances() -> None:
    with pytest.raises(InputError, match="want points of shape"):
        TOUCH.apply(np.zeros((1, 5, 3)))
    with pytest.raises(InputError, match="compliances"):
        contact(np.full(2 * COUNT, -1.0))
