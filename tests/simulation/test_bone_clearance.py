"""How much flesh is left between the bones of two digits."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.simulation.solve.bone_clearance import TightBone, nearest_digits


def rods(apart: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of three straight bones side by side, the first two ``apart``, the third far off; flesh of 3 mm."""
    along = np.linspace(0.0, 0.05, 26)
    x = np.concatenate([np.stack([np.full(26, at), along, 0.0 * along], axis=1) for at in (0.0, apart, 0.1)])
    return x, np.repeat([4, 2, 7], 26), np.full(78, 3e-3)


def test_fingers_that_just_touch_have_all_their_flesh() -> None:
    assert nearest_digits(*rods(6.001e-3)) == []


def test_the_flesh_between_two_bones_is_that_of_both() -> None:
    (found,) = nearest_digits(*rods(1.5e-3))
    assert set(found[:2]) == {2, 4}
    assert found[2:] == pytest.approx((0.25, 1.5e-3))


def test_a_thinner_place_counts_even_where_bones_are_farther_apart() -> None:
    x, digit, depth = rods(4e-3)
    x[:13, 0] -= 1e-3
    depth[:13] *= 3.0
    (found,) = nearest_digits(x, digit, depth)
    assert found[2:] == pytest.approx((5.0 / 12.0, 5e-3))


def test_it_says_what_of_whom() -> None:
    one = TightBone("LEFT", "index", "the bone of middle", 0.16, 1.07e-3)
    assert one.text == "the bone of LEFT index is 1.1 mm from the bone of middle, 16 % of the flesh between them"


def test_bones_of_two_actors_are_told() -> None:
    one = TightBone("OTHER", "index", "the bones of BODY", 0.36, 5.4e-3)
    assert one.text == "the bone of OTHER index is 5.4 mm from the bones of BODY, 36 % of the flesh between them"
    other = TightBone("BODY", "", "the bones of OTHER", -0.1, -1e-3)
    assert other.text == "a bone of BODY is 1 mm inside the bones of OTHER, which cannot give way"
