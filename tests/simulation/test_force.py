"""A wished force of springs whose answer is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from warpjld.errors import InputError
from warpjld.simulation.grip.force import ForceStatus, PressedForce, force_grip

Press = Callable[[float], PressedForce]
Close = Callable[[float], Iterator[tuple[float, PressedForce]]]


def pad(stiffness: float = 4e3, touch: float = 1e-3, limit: float = math.inf) -> Press:
    """Force grows with the square of the way beyond the first touch, as pulp does."""

    def press(grip: float) -> PressedForce:
        force = stiffness * max(0.0, grip - touch) ** 2 * 1e3
        return PressedForce(force, force / limit, "index")

    return press


def closing(press: Press, step: float = 5e-4, solvable: float = math.inf) -> Close:
    """Closes in load steps from the largest grip gone to below, up to ``solvable``."""
    known: set[float] = set()

    def close(grip: float) -> Iterator[tuple[float, PressedForce]]:
        at = max((one for one in known if one <= grip), default=0.0)
        steps = max(1, math.ceil((grip - at) / step))
        for ahead in [at + (grip - at) * (k + 1) / steps for k in range(steps - 1)] + [grip]:
            if ahead > solvable:
                return
            known.add(ahead)
            yield ahead, press(ahead)

    return close


@pytest.mark.parametrize("force", [0.02, 1.0, 30.0])
def test_the_force_is_reached(force: float) -> None:
    found = force_grip(closing(pad()), 0.0, 0.01, force)
    assert found.status is ForceStatus.REACHED
    assert found.pressed is not None
    assert found.pressed.force == pytest.approx(force, rel=0.02)
    assert found.grip == pytest.approx(1e-3 + math.sqrt(force / 4e6), rel=0.02)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("force", [2.0, 8.0])
def test_no_grip_is_tried_further_beyond_it_than_a_load_step(power: float, force: float) -> None:
    """From a finger that touches already; few grips are tried once one was firm enough."""

    def press(grip: float) -> PressedForce:
        return PressedForce(0.4 * ((grip + 1e-3) / 1e-3) ** power)

    step = 5e-4
    found = force_grip(closing(press, step), 0.0, 0.05, force)
    assert found.status is ForceStatus.REACHED
    tried = [grip for grip, _ in found.trials]
    assert max(tried) <= found.grip + step
    first = next(k for k, (_, pressed) in enumerate(found.trials) if pressed.force >= 0.98 * force)
    assert len(tried) - first <= 4


def test_what_was_tried_is_kept_when_interrupted() -> None:
    pressed = pad()

    def press(grip: float) -> PressedForce:
        if grip > 1e-3:
            raise KeyboardInterrupt
        return pressed(grip)

    found = force_grip(closing(press, 1e-4), 0.0, 0.01, 1.0)
    assert found.status is ForceStatus.INTERRUPTED
    assert len(found.trials) > 2
    assert "interrupted" in found.text


@pytest.mark.parametrize(("spent", "status"), [(False, ForceStatus.NO_SOLUTION), (True, ForceStatus.EXHAUSTED)])
def test_the_firmest_grip_is_kept_where_equilibria_end(spent: bool, status: ForceStatus) -> None:
    """Grips beyond 3 mm cannot be solved."""
    found = force_grip(closing(pad(), solvable=3e-3), 0.0, 0.01, 30.0, exhausted=lambda: spent)
    assert found.status is status
    assert found.grip == pytest.approx(3e-3, abs=5e-4)
    assert f"{status.value}; 30 N asked for" in found.text


def test_muscles_are_too_weak() -> None:
    found = force_grip(closing(pad(limit=2.0)), 0.0, 0.01, 3.0)
    assert found.status is ForceStatus.TOO_WEAK
    assert found.pressed is not None
    assert found.pressed.force <= 2.0
    assert "more force would be needed than the muscles have; 3 N asked for" in found.text
    assert "of what index can" in found.text


def test_reasons_why_a_force_is_out_of_reach() -> None:
    bent = force_grip(closing(pad()), 0.0, 2e-3, 30.0)
    assert bent.status is ForceStatus.LIMIT
    assert bent.grip == 2e-3
    assert "bent as far as they may; 30 N asked for, 4 N reached" in bent.text
    assert force_grip(closing(pad(touch=1.0)), 0.0, 0.01, 1.0).status is ForceStatus.NO_CONTACT
    hard = force_grip(closing(pad(touch=-0.01)), 0.0, 0.01, 1.0)
    assert hard.status is ForceStatus.HARDER_ALREADY
    assert hard.grip == 0.0


@pytest.mark.parametrize(("low", "high", "force"), [(1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, math.nan)])
def test_what_cannot_be_is_refused(low: float, high: float, force: float) -> None:
    with pytest.raises(InputError, match="grip: want"):
        force_grip(closing(pad()), low, high, force)
