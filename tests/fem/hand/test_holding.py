"""The gentlest grip asked of the contact solver: two soft pads and a block (R123)."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Status
from warpjld.fem.hand.grip import GripStatus, gentlest_grip
from warpjld.fem.hand.holding import Holding
from warpjld.fem.hand.tactile import tactile_of_pairs

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "hold_block.py"
WEIGHT, FRICTION = 0.6, 0.5


@pytest.fixture
def holding() -> Holding:
    made: Holding = runpy.run_path(str(EXAMPLE))["pads_and_block"](WEIGHT, FRICTION)
    return made


def test_a_firmer_grip_holds_without_much_sliding(holding: Holding) -> None:
    trial = holding(1.5e-4)
    assert trial is not None
    assert trial.held
    assert trial.sliding < 0.5
    assert 0.5 * trial.force > WEIGHT / (2.0 * FRICTION)
    assert sum(touch.force[2] for touch in holding.found[1.5e-4].last.touches) == pytest.approx(-WEIGHT, rel=5e-3)


@pytest.mark.slow
def test_pads_press_with_half_the_weight_over_friction(holding: Holding) -> None:
    found = gentlest_grip(holding, 1.05e-4, 1.2e-4, weight=WEIGHT, friction=FRICTION, start=5e-6, tolerance=0.4)
    assert found.status is GripStatus.HELD
    assert found.trial is not None
    needed = WEIGHT / (2.0 * FRICTION)
    assert needed <= 0.5 * found.trial.force <= 1.03 * needed
    assert 0.8 < found.trial.sliding < 1.0
    solution = holding.found[found.grip]
    for touch in solution.last.touches:
        assert touch.force[2] == pytest.approx(-0.5 * WEIGHT, rel=5e-3)
        np.testing.assert_allclose(touch.nodal.sum(axis=0), 0.0, atol=1e-9)
    gentler = [holding.found[grip] for grip, trial in found.trials if not trial.held]
    assert gentler
    assert all(tried.status is Status.SLIDING for tried in gentler)

    felt = tactile_of_pairs(solution.instants)
    assert felt.pads == ("pad.left", "pad.right")
    np.testing.assert_allclose(felt.normal_force[-1].sum(), found.trial.force, rtol=1e-12)
    np.testing.assert_allclose(felt.force[:, 0, 0], -felt.force[:, 1, 0], rtol=1e-2)
    assert (np.diff(felt.slip[1:], axis=0) > 0.0).all()
    np.testing.assert_allclose(felt.centre[-1, 1], [0.015, 0.0, 0.0], atol=1.5e-3)


def test_a_limit_that_is_too_low_is_named(holding: Holding) -> None:
    holding.weighing = 1
    found = gentlest_grip(holding, 5e-5, 6e-5, weight=WEIGHT, friction=FRICTION, start=6e-5 - 5e-5)
    assert found.status is GripStatus.LIMIT
    assert "does not hold at the firmest grip" in found.text
    assert found.grip == 6e-5
    assert holding.found[6e-5].status is Status.SLIDING
    assert found.trial is not None
    assert 0.5 * found.trial.force < WEIGHT / (2.0 * FRICTION)


def test_what_cannot_be_is_refused(holding: Holding) -> None:
    with pytest.raises(InputError, match="an instant or more"):
        Holding(holding.body, holding.prescribed, holding.pairs, weighing=0)
    with pytest.raises(InputError, match="want a pair"):
        Holding(holding.body, holding.prescribed, [])
    with pytest.raises(InputError, match="at least one instant"):
        tactile_of_pairs([])
