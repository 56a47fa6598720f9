"""A wished force of springs whose answer is known."""

from __future__ import annotations

import math

import pytest

from warpjld.errors import InputError
from warpjld.simulation.grip.force import ForceStatus, PressedForce, force_grip


def pad(stiffness: float = 4e3, touch: float = 1e-3, limit: float = math.inf):  # type: ignore[no-untyped-def]
    """Force grows with the square of the way beyond the first touch, as pulp does."""

    def press(grip: float) -> PressedForce:
        force = stiffness * max(0.0, grip - touch) ** 2 * 1e3
        return PressedForce(force, force / limit, "index")

    return press


@pytest.mark.parametrize("force", [0.02, 1.0, 30.0])
def test_the_force_is_reached(force: float) -> None:
    found = force_grip(pad(), 0.0, 0.01, force, start=1e-4)
    assert found.status is ForceStatus.REACHED
    assert found.pressed is not None
    assert found.pressed.force == pytest.approx(force, rel=0.02)
    assert found.grip == pytest.approx(1e-3 + math.sqrt(force / 4e6), rel=0.02)
    assert len(found.trials) < 25


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("force", [2.0, 8.0])
def test_slopes_find_it_in_four_trials(power: float, force: float) -> None:
    """From a finger that touches already, and presses with a twentieth or a fifth of it."""

    def press(grip: float) -> PressedForce:
        pressed = 0.4 * ((grip + 1e-3) / 1e-3) ** power
        return PressedForce(pressed, slope=power * pressed / (grip + 1e-3))

    found = force_grip(press, 0.0, 0.05, force, start=1e-2)
    assert found.status is ForceStatus.REACHED
    assert len(found.trials) <= 4


def test_what_was_tried_is_kept_when_interrupted() -> None:
    pressed = pad()

    def press(grip: float) -> PressedForce:
        if grip > 1e-3:
            raise KeyboardInterrupt
        return pressed(grip)

    found = force_grip(press, 0.0, 0.01, 1.0, start=1e-4)
    assert found.status is ForceStatus.INTERRUPTED
    assert len(found.trials) > 2
    assert "interrupted" in found.text


def test_lost_equilibria_are_gone_half_the_way() -> None:
    """Grips beyond 3 mm cannot be solved; the wished force lies before."""
    pressed = pad()
    found = force_grip(lambda grip: None if grip > 3e-3 else pressed(grip), 0.0, 0.01, 14.0, start=1.5e-3)
    assert found.status is ForceStatus.REACHED


def test_muscles_are_too_weak() -> None:
    found = force_grip(pad(limit=2.0), 0.0, 0.01, 3.0, start=1e-4)
    assert found.status is ForceStatus.TOO_WEAK
    assert found.pressed is not None
    assert found.pressed.force <= 2.0
    assert "more force would be needed than the muscles have; 3 N asked for" in found.text
    assert "of what index can" in found.text


def test_reasons_why_a_force_is_out_of_reach() -> None:
    bent = force_grip(pad(), 0.0, 2e-3, 30.0)
    assert bent.status is ForceStatus.LIMIT
    assert bent.grip == 2e-3
    assert "bent as far as they may; 30 N asked for, 4 N reached" in bent.text
    assert force_grip(pad(touch=1.0), 0.0, 0.01, 1.0).status is ForceStatus.NO_CONTACT
    hard = force_grip(pad(touch=-0.01), 0.0, 0.01, 1.0)
    assert hard.status is ForceStatus.HARDER_ALREADY
    assert hard.grip == 0.0
    lost = force_grip(lambda g: None if g > 2e-3 else PressedForce(1e-3), 0.0, 0.01, 1.0)
    assert lost.status is ForceStatus.NO_SOLUTION
    assert lost.pressed == PressedForce(1e-3)


@pytest.mark.parametrize(("low", "high", "force"), [(1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, math.nan)])
def test_what_cannot_be_is_refused(low: float, high: float, force: float) -> None:
    with pytest.raises(InputError, match="grip: want"):
        force_grip(pad(), low, high, force)
    with pytest.raises(InputError, match="want a first step above 0"):
        force_grip(pad(), 0.0, 1.0, 1.0, start=-1.0)
