"""The gentlest grip asked of the contact solver: two soft pads and a block (R123)."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem.contact import Pair
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.simulation.grip.prescribed_trials import PrescribedTrials
from warpjld.simulation.grip.search import GripStatus, TrialOutcome, gentlest_grip
from warpjld.simulation.report.tactile import tactile_of_pairs

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "hold_block.py"
WEIGHT, FRICTION = 0.6, 0.5


@pytest.fixture
def holding() -> PrescribedTrials:
    made: PrescribedTrials = runpy.run_path(str(EXAMPLE))["pads_and_block"](WEIGHT, FRICTION)
    return made


def test_a_firmer_grip_holds_without_much_sliding(holding: PrescribedTrials) -> None:
    trial = holding(1.5e-4)
    assert trial.held
    assert trial.sliding < 0.5
    assert 0.5 * trial.force > WEIGHT / (2.0 * FRICTION)
    last = holding.found[1.5e-4].last
    assert sum(touch.force[2] for touch in last.touches) == pytest.approx(-WEIGHT, rel=5e-3)
    assert not last.reactions[holding.weight.handle].any()
    # the hand bears more the deeper the block sinks, until it bears all
    sunk, borne = np.array(holding.lowered[1.5e-4].path).T
    assert (np.diff(sunk) > 0.0).all()
    assert (np.diff(borne) > 0.0).all()
    assert borne[-1] == pytest.approx(1.0, abs=0.1)


def test_a_gentler_grip_slides_at_every_point(holding: PrescribedTrials) -> None:
    """Friction bears what Coulomb says it can, however deep the block sinks: found, not concluded from a solver."""
    trial = holding(1.06e-4)
    assert trial.outcome is TrialOutcome.SLIDES
    assert trial.sliding == 1.0
    instants = holding.found[1.06e-4].instants
    slid = [instant for instant in instants if holding.weight.sliding(instant) == 1.0]
    assert len(slid) >= 2
    borne = np.array([WEIGHT * (1.0 - holding.weight.left(instant)) for instant in slid])
    limits = np.array([FRICTION * holding.weight.force(instant) for instant in slid])
    assert (borne < WEIGHT).all()
    assert (borne <= 1.002 * limits).all()
    assert borne[-1] == pytest.approx(limits[-1], rel=5e-3)  # by now friction points straight up
    assert trial.borne == pytest.approx(0.98, abs=0.02)


def test_a_grip_too_weak_is_known_before_the_weight_comes_on(holding: PrescribedTrials) -> None:
    trial = holding(5e-5)
    assert trial.outcome is TrialOutcome.WEAK
    assert trial.borne == pytest.approx(FRICTION * trial.force / WEIGHT, rel=1e-3)
    assert len(holding.found[5e-5].instants) == 1


def test_a_block_that_stands_is_not_held(holding: PrescribedTrials) -> None:
    """A floor a twentieth of a millimetre below: the block sinks onto it before the pads bear its weight."""
    floor = Plane((0.0, 0.0, -0.015 - 5e-5), (0.0, 0.0, 1.0))
    standing = PrescribedTrials(
        holding.body, holding.prescribed, holding.pairs, "block", others=[Pair("block.z-", floor, friction=0.5)]
    )
    trial = standing(1.5e-4)
    assert trial.outcome is TrialOutcome.STANDS
    assert standing.weight.elsewhere(standing.found[1.5e-4].last) > 0.01


@pytest.mark.slow
def test_pads_press_with_half_the_weight_over_friction(holding: PrescribedTrials) -> None:
    found = gentlest_grip(holding, 2e-5, 1e-3, weight=WEIGHT, friction=FRICTION, start=5e-5, tolerance=0.004)
    assert found.status is GripStatus.HELD
    needed = WEIGHT / (2.0 * FRICTION)
    assert 0.5 * found.trial.force == pytest.approx(needed, rel=0.02)
    assert holding.weight.used(holding.found[found.grip].last) > 0.97
    solution = holding.found[found.grip]
    for touch in solution.last.touches:
        assert touch.force[2] == pytest.approx(-0.5 * WEIGHT, rel=5e-3)
        np.testing.assert_allclose(touch.nodal.sum(axis=0), 0.0, atol=1e-9)
    gentler = {trial.outcome for _, trial in found.trials if not trial.held}
    assert gentler
    assert gentler <= {TrialOutcome.WEAK, TrialOutcome.SLIDES}

    felt = tactile_of_pairs(solution.instants)
    assert felt.pads == ("pad.left", "pad.right")
    np.testing.assert_allclose(felt.normal_force[-1].sum(), found.trial.force, rtol=1e-12)
    np.testing.assert_allclose(felt.force[:, 0, 0], -felt.force[:, 1, 0], rtol=1e-2)
    np.testing.assert_allclose(felt.centre[-1, 1], [0.015, 0.0, 0.0], atol=1.5e-3)


def test_a_limit_that_is_too_low_is_named(holding: PrescribedTrials) -> None:
    found = gentlest_grip(holding, 5e-5, 6e-5, weight=WEIGHT, friction=FRICTION, start=6e-5 - 5e-5)
    assert found.status is GripStatus.LIMIT
    assert "does not hold at the firmest grip" in found.text
    assert found.grip == 6e-5
    assert found.ended == "2 grips were tried: 2 pressed too little for friction to bear the weight"
    assert 0.5 * found.trial.force < WEIGHT / (2.0 * FRICTION)


def test_what_cannot_be_is_refused(holding: PrescribedTrials) -> None:
    body, known, pairs = holding.body, holding.prescribed, holding.pairs
    with pytest.raises(InputError, match="pairs: want one"):
        PrescribedTrials(body, known, [], "block")
    with pytest.raises(InputError, match="there is no region 'blok'; there are block, "):
        PrescribedTrials(body, known, pairs, "blok")
    with pytest.raises(InputError, match="gravity: want a pull along one axis"):
        PrescribedTrials(body, known, pairs, "block", (1.0, 0.0, -9.81))
    with pytest.raises(InputError, match="at least one instant"):
        tactile_of_pairs([])
