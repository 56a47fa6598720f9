"""Skin laid on rigid objects, on a ball pressed on a plate whose overlap is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.touch.test_touch import BALL, FACES, RADIUS
from warpjld.covering.quality import enclosed_volume
from warpjld.errors import InputError
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.objects import Places
from warpjld.grasp.shapes import box
from warpjld.touch import Touch
from warpjld.touch.held import flatten_on
from warpjld.touch.patches import patches

PLATE = ObjectSet(box(0.1, 0.1, 0.1))
TOUCH = Touch(patches(FACES, np.zeros(len(BALL), np.int32), ("ball",), np.full(len(BALL), RADIUS)), BALL)


def pressed(depths: list[float]) -> tuple[NDArray[np.float32], Places, list]:
    """The ball so far inside the plate's upper face, y = 0 in its frame, one a frame; and what is told."""
    at = np.array([[0.0, depth - RADIUS - 0.05, 0.0] for depth in depths])
    places = Places.of(at)
    points = np.repeat(BALL[None].astype(np.float32), len(depths), axis=0)
    out, told = flatten_on(TOUCH, points, PLATE, [places], first=3)
    return out, places, told


def heights(points: NDArray[np.float32], depth: float) -> NDArray[np.float64]:
    """Over the plate [m]."""
    return points[:, 1].astype(np.float64) - (depth - RADIUS)


def test_skin_inside_is_laid_on_the_surface_and_a_little_beyond() -> None:
    depth = 0.2 * RADIUS
    (after,), _, told = pressed([depth])
    assert not told
    inside = BALL[:, 1] < depth - RADIUS
    assert inside.sum() > 50
    over = heights(after, depth)
    assert over.min() >= 0.0
    assert over[inside].max() < 0.03 * RADIUS
    middle = inside & (np.hypot(BALL[:, 0], BALL[:, 2]) < 0.3 * RADIUS)
    assert middle.sum() > 20
    np.testing.assert_allclose(after[middle][:, [0, 2]], BALL[middle][:, [0, 2]], atol=2e-3 * RADIUS)


def test_what_is_far_from_the_object_stays_bit_for_bit() -> None:
    (after,), _, _ = pressed([0.2 * RADIUS])
    far = BALL[:, 1] > 0.4 * RADIUS
    assert far.sum() > 300
    np.testing.assert_array_equal(after[far], BALL[far].astype(np.float32))
    (clear,), _, _ = pressed([-0.01 * RADIUS])
    np.testing.assert_array_equal(clear, BALL.astype(np.float32))


def test_volume_is_given_back_beside_it() -> None:
    depth = 0.1 * RADIUS
    (after,), _, _ = pressed([depth])
    cap = np.pi * depth**2 * (RADIUS - depth / 3.0)
    lost = float(enclosed_volume(BALL, FACES) - enclosed_volume(after, FACES))
    assert abs(lost) < 0.3 * cap
    beside = (heights(BALL.astype(np.float32), depth) > 0.0) & (after != BALL.astype(np.float32)).any(axis=1)
    assert beside.any(), "what bulges was not inside"


def test_it_begins_with_nothing_and_grows_without_leaps() -> None:
    depths = np.linspace(-0.01, 0.3, 63) * RADIUS
    after, _, _ = pressed(depths.tolist())
    steps = np.linalg.norm(np.diff(after, axis=0), axis=2).max(axis=1)
    assert steps.max() < 0.06 * RADIUS, "the plate moves by .005 of it"


def test_what_is_too_deep_is_told_and_left_alone() -> None:
    (near, deep), _, told = pressed([0.45 * RADIUS, 0.99 * RADIUS])
    assert [(one.part, one.other, one.frame) for one in told] == [("ball", "box", 3), ("ball", "box", 4)]
    assert told[0].depth == pytest.approx(0.45 * RADIUS, rel=0.02)
    assert heights(near, 0.45 * RADIUS).min() >= 0.0
    np.testing.assert_array_equal(deep, BALL.astype(np.float32))


def test_refuses_places_that_do_not_fit() -> None:
    points = BALL[None].astype(np.float32)
    with pytest.raises(InputError, match="want 1 places for each of 1 objects"):
        flatten_on(TOUCH, points, PLATE, [Places.of(np.zeros((2, 3)))])
    with pytest.raises(InputError, match="vertices"):
        flatten_on(TOUCH, points[:, 1:], PLATE, [Places.of()])
