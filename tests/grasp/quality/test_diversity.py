"""Diversity of many grasps, against cases with a formula."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.quality import diversity

_LIMITS = np.array([[0.0, 1.0], [-1.0, 1.0]])


def test_grasps_that_are_all_the_same() -> None:
    found = diversity(np.full((7, 2), 0.5), _LIMITS, np.tile([0.0, 0.0, 2.0], (7, 1)))
    assert (found.grasps, found.entropy, found.entropy_spread) == (7, 0.0, 0.0)
    assert (found.first_component, found.approach_spread) == (1.0, pytest.approx(0.0, abs=1e-12))


def test_even_angles_have_the_largest_entropy() -> None:
    even = (np.arange(100) + 0.5) / 100.0
    angles = np.column_stack([even, np.where(np.arange(100) < 50, -0.5, 0.5)])
    found = diversity(angles, _LIMITS, np.eye(3)[np.arange(100) % 3])
    # ln 100 for one bin each, ln 2 for two bins
    assert found.entropy == pytest.approx((np.log(100.0) + np.log(2.0)) / 2.0)
    assert found.entropy_spread == pytest.approx((np.log(100.0) - np.log(2.0)) / 2.0)
    assert found.approach_spread == pytest.approx(1.0 - 1.0 / np.sqrt(3.0), abs=1e-2)


def test_the_first_component_of_variances_that_are_known() -> None:
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = np.array([[a, b, c] for a in (-3.0, 3.0) for b in (-2.0, 2.0) for c in (-1.0, 1.0)])
    found = diversity(corners @ turn.T, np.tile([-9.0, 9.0], (3, 1)), np.concatenate([np.eye(3)] * 2 + [np.eye(3)[:2]]))
    assert found.first_component == pytest.approx(9.0 / 14.0)


def test_angles_beyond_their_limits_count_in_the_last_bin() -> None:
    found = diversity([[5.0, 0.0], [0.999, 0.0]], _LIMITS, [[1.0, 0, 0], [-1.0, 0, 0]])
    assert found.entropy == 0.0
    assert found.approach_spread == pytest.approx(1.0)


def test_what_cannot_be_is_named() -> None:
    with pytest.raises(InputError, match="want angles"):
        diversity(np.zeros((0, 2)), _LIMITS, np.zeros((0, 3)))
    with pytest.raises(InputError, match="leave no room"):
        diversity(np.zeros((1, 1)), [[1.0, 1.0]], [[1.0, 0, 0]])
    with pytest.raises(InputError, match="no direction"):
        diversity(np.zeros((1, 2)), _LIMITS, [[0.0, 0, 0]])
