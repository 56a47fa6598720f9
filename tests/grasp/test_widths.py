"""Widths of objects that are known, and where a hand is opened by so much."""

import numpy as np

from warpjld.geometry.rotations import unit
from warpjld.grasp.digits import pad_vertex
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.opening import closing_in_air
from warpjld.grasp.placements import across_widths, around
from warpjld.grasp.postures import posture_angles
from warpjld.grasp.shapes import ball, box
from warpjld.grasp.widths import sample_widths
from warpjld.skeleton import DIGITS


def test_lines_through_a_ball_are_as_long_as_its_chords() -> None:
    thing = ball(0.06, subdivisions=4).placed([0.3, -0.2, 0.1], (0.2, 0.3, 0.1, 0.9))
    found = sample_widths(NearObject(thing), 60, np.random.default_rng(0), widest=0.1)
    assert len(found) == 60
    np.testing.assert_allclose(found.width, 0.06 * found.slant, rtol=0.02)
    ends = np.concatenate([found.first, found.second])
    np.testing.assert_allclose(np.linalg.norm(ends - [0.3, -0.2, 0.1], axis=1), 0.03, atol=4e-4)


def test_only_what_fits_is_found() -> None:
    found = sample_widths(NearObject(box(0.2, 0.03, 0.15)), 80, np.random.default_rng(0), widest=0.06)
    assert len(found) > 20
    assert (found.width <= 0.06).all()
    upright = np.abs((found.second - found.first)[:, 1]) / found.width
    assert np.median(upright) > 0.9  # through the thin side


def test_pads_meet_the_ends_of_a_width(covering) -> None:
    """Thumb and fingers come to either side of the width, without touching."""
    closing = ("thumb", "index", "middle")
    start = posture_angles(covering.skeleton, "left", "pinch")
    (opening,) = closing_in_air(covering, "left", start[None], closing)
    assert (np.diff(opening.width[:6]) < 0).all()
    assert opening.width[opening.step_for(0.05)] >= 0.05
    assert opening.step_for(1.0) == 0
    near, rng = NearObject(ball(0.02, subdivisions=3)), np.random.default_rng(1)
    widths = sample_widths(near, 12, rng, widest=0.05)
    ways = around(unit(widths.second - widths.first), rng)
    hands = across_widths(covering, [opening], near, widths, ways, "left", rng, into=0.0)
    skin = covering.deform(hands.poses(covering.skeleton))
    assert near.least(skin).min() > 0.0
    closed = np.repeat(opening.angles[opening.step_for(0.02)][None], len(hands), axis=0)
    pads = [pad_vertex(covering, f"left.{digit}") for digit in ("thumb", "index", "middle")]
    at = covering.points(hands.poses(covering.skeleton, closed), np.array(pads))
    line = at[:, 1:].mean(axis=1) - at[:, 0]
    cosine = (line * (widths.second - widths.first)).sum(axis=1) / np.linalg.norm(line, axis=1) / widths.width
    np.testing.assert_allclose(cosine, 1.0, atol=0.02)


def test_a_hand_that_curls_keeps_to_its_limits(covering) -> None:
    start = posture_angles(covering.skeleton, "left", "sphere")
    (opening,) = closing_in_air(covering, "left", start[None], DIGITS)
    np.testing.assert_array_equal(opening.angles[0], start)
    low, high = covering.skeleton.limits[:, 0].T
    bent = opening.angles[..., 0]
    assert ((bent >= low - 1e-9) & (bent <= high + 1e-9)).all()
