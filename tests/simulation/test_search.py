"""The gentlest grip of blocks whose answer is known."""

from __future__ import annotations

import math

import pytest

from warpjld.errors import InputError
from warpjld.simulation.grip.bracket import Bracket
from warpjld.simulation.grip.search import GripStatus, Trial, TrialOutcome, gentlest_grip


def ended(held: bool) -> TrialOutcome:
    return TrialOutcome.HELD if held else TrialOutcome.SLIDES


def squeezed(weight: float, friction: float, stiffness: float = 4e3, touch: float = 1e-3, limit: float = math.inf):  # type: ignore[no-untyped-def]
    """Two springy fingers squeeze a block between them: N each, held where 2 μ N ≥ W."""

    def hold(closing: float) -> Trial:
        each = stiffness * max(0.0, closing - touch)
        held = 2.0 * friction * each >= weight and each > 0.0
        sliding = math.nan if each == 0.0 else 0.0 if held else 1.0
        borne = 2.0 * friction * each / weight
        slope = 2.0 * friction * stiffness / weight if each > 0.0 else None
        return Trial(ended(held), sliding, 2.0 * each, borne, each / limit, "index", slope=slope)

    return hold


@pytest.mark.parametrize(("weight", "friction"), [(2.0, 0.5), (0.3, 0.9), (15.0, 0.6)])
def test_block_between_two_fingers(weight: float, friction: float) -> None:
    found = gentlest_grip(squeezed(weight, friction), 0.0, 0.05, weight=weight, friction=friction, tolerance=1e-3)
    assert found.status is GripStatus.HELD
    needed = weight / (2.0 * friction)
    assert found.trial.force / 2.0 == pytest.approx(needed, rel=0.02)
    assert found.trial.force / 2.0 >= needed
    assert found.grip == pytest.approx(1e-3 + needed / 4e3, rel=2e-3)
    assert len(found.trials) <= 8  # the tangent says where to look, once something is touched: halving takes 14 to 16


def test_wedge_slides_out_however_hard() -> None:
    """Faces that lean by α > atan μ: the squeeze itself drives the wedge out, whatever it weighs."""
    lean, friction, weight = math.radians(40.0), 0.5, 1.0

    def hold(force: float) -> Trial:
        held = force * (friction * math.cos(lean) - math.sin(lean)) * 2.0 >= weight
        return Trial(ended(held), 0.0 if held else 1.0, 2.0 * force)

    found = gentlest_grip(hold, 0.0, 1000.0, weight=weight, friction=friction)
    assert found.status is GripStatus.SLIDES
    assert "friction cones" in found.text
    assert found.grip < 1000.0


def test_reasons_why_none_holds() -> None:
    weak = gentlest_grip(squeezed(50.0, 0.5, limit=20.0), 0.0, 0.1, weight=50.0, friction=0.5)
    assert weak.status is GripStatus.TOO_WEAK
    assert "index at" in weak.text
    away = gentlest_grip(squeezed(1.0, 0.5, touch=1.0), 0.0, 0.1, weight=1.0, friction=0.5)
    assert away.status is GripStatus.NO_CONTACT
    short = gentlest_grip(squeezed(1e3, 0.5), 0.0, 0.02, weight=1e3, friction=0.5)
    assert short.status is GripStatus.LIMIT
    assert short.grip == 0.02
    slippery = gentlest_grip(squeezed(1.0, 0.0), 0.0, 0.1, weight=1.0, friction=0.0)
    assert slippery.status is GripStatus.SLIDES
    easy = gentlest_grip(squeezed(1e-3, 0.5, touch=-1.0), 0.0, 0.1, weight=1e-3, friction=0.5)
    assert easy.status is GripStatus.HELD_AT_ONCE
    assert len(easy.trials) == 1


def test_trials_that_cannot_be_solved_say_nothing() -> None:
    """The search goes on beside them, and counts them."""
    block = squeezed(1.0, 0.5)

    def hold(grip: float) -> Trial:
        lost = Trial(TrialOutcome.UNSOLVED, math.nan, 1.0)
        return lost if grip < 0.001 or 0.0018 < grip < 0.0032 else block(grip)

    found = gentlest_grip(hold, 0.0, 0.05, weight=1.0, friction=0.5)
    assert found.status is GripStatus.HELD
    assert found.grip == pytest.approx(0.0032, rel=0.02)
    lost = sum(trial.outcome is TrialOutcome.UNSOLVED for _, trial in found.trials)
    assert lost >= 2
    assert f"{lost} could not be solved" in found.ended
    assert found.ended.startswith(f"{len(found.trials)} grips were tried: ")
    never = gentlest_grip(lambda grip: Trial(TrialOutcome.UNSOLVED, math.nan, 1.0), 0.0, 0.1, weight=9.0, friction=0.5)
    assert never.status is GripStatus.NO_SOLUTION


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("share", [0.5, 0.2, 0.05])
def test_slopes_find_it_in_four_trials_from_a_touch(power: float, share: float) -> None:
    """Pads that stiffen touch already, by the gentlest grip with a share of what it takes."""

    def hold(grip: float) -> Trial:
        way = (grip + 0.2e-3) / 0.2e-3
        capacity, slope = share * way**power, share * power * way ** (power - 1.0) / 0.2e-3
        return Trial(ended(capacity >= 1.0), 0.0, 2.0, capacity, capacity=capacity, slope=slope)

    found = gentlest_grip(hold, 0.0, 5e-3, weight=1.0, friction=0.6, start=1e-3, tolerance=0.03)
    assert found.status is GripStatus.HELD
    assert 1.0 <= found.trial.capacity <= 1.03
    assert len(found.trials) <= 4


def test_friction_that_balances_moments_takes_more() -> None:
    """A grip that holds from a capacity of 1.4 on: what slides at less says so, and the search aims there."""

    def hold(grip: float) -> Trial:
        capacity = 0.3 + 400.0 * grip
        return Trial(ended(capacity >= 1.4), 0.0, 2.0, min(capacity / 1.4, 1.0), capacity=capacity, slope=400.0)

    found = gentlest_grip(hold, 0.0, 0.02, weight=1.0, friction=0.6, start=1e-4, tolerance=0.03)
    assert found.status is GripStatus.HELD
    assert 1.4 <= found.trial.capacity <= 1.03 * 1.4
    assert len(found.trials) <= 5


def test_what_was_tried_is_kept_when_interrupted() -> None:
    block, tried = squeezed(2.0, 0.5), []

    def hold(grip: float) -> Trial:
        tried.append(grip)
        if len(tried) > 3:
            raise KeyboardInterrupt
        return block(grip)

    found = gentlest_grip(hold, 0.0, 0.05, weight=2.0, friction=0.5, tolerance=1e-3)
    assert found.status is GripStatus.INTERRUPTED
    assert [grip for grip, _ in found.trials] == tried[:3]
    assert "interrupted" in found.text
    at_once = gentlest_grip(_interrupted, 0.0, 0.05, weight=2.0, friction=0.5)
    assert at_once.status is GripStatus.INTERRUPTED
    assert at_once.trials == ()


def _interrupted(grip: float) -> Trial:
    raise KeyboardInterrupt


def test_what_held_is_returned_when_the_linear_solves_are_spent() -> None:
    block, tried = squeezed(2.0, 0.5), []

    def hold(grip: float) -> Trial:
        tried.append(block(grip))
        return tried[-1]

    rest = {"weight": 2.0, "friction": 0.5, "tolerance": 1e-6}
    found = gentlest_grip(hold, 0.0, 0.05, exhausted=lambda: tried[-1].held, **rest)
    assert found.status is GripStatus.HELD_SO_FAR
    assert found.trial is tried[-1]
    weak = Trial(TrialOutcome.WEAK, 1.0, 3.0, 0.8, capacity=0.8)
    unsolved = Trial(TrialOutcome.UNSOLVED, math.nan, 4.0)
    ahead = [weak, unsolved]
    nothing = gentlest_grip(lambda grip: ahead.pop(0), 0.0, 0.05, exhausted=lambda: not ahead, **rest)
    assert nothing.status is GripStatus.EXHAUSTED
    assert [trial for _, trial in nothing.trials] == [weak, unsolved]
    assert nothing.trial is weak


def test_trials_have_a_budget() -> None:
    found = gentlest_grip(squeezed(2.0, 0.5), 0.0, 0.05, weight=2.0, friction=0.5, tolerance=1e-6, most=5)
    assert len(found.trials) == 5
    assert found.status is GripStatus.HELD_SO_FAR
    assert found.trial.held


def test_what_stands_on_something_else_is_not_held() -> None:
    note = "TABLE bears 0.9 N of it"
    found = gentlest_grip(
        lambda grip: Trial(TrialOutcome.STANDS, 0.0, 50.0 * grip, note=note), 0.0, 1.0, weight=1.0, friction=0.5
    )
    assert found.status is GripStatus.STANDS
    assert note in found.text
    assert found.ended == "6 grips were tried: 6 left it standing on something else"


def test_held_only_with_more_than_muscles_have() -> None:
    """The grip that holds is found between a step that is too gentle and one that is too hard for the muscles."""
    # 5 N each are needed, 6 N each is the limit: coarse steps overshoot it, the answer does not
    found = gentlest_grip(squeezed(5.0, 0.5, limit=6.0), 0.0, 0.05, weight=5.0, friction=0.5)
    assert found.status is GripStatus.HELD
    over = gentlest_grip(squeezed(5.0, 0.5, limit=4.0), 0.0, 0.05, weight=5.0, friction=0.5)
    assert over.status is GripStatus.TOO_WEAK


@pytest.mark.parametrize(
    ("low", "high", "weight", "friction"),
    [(1.0, 1.0, 1.0, 0.5), (0.0, math.nan, 1.0, 0.5), (0.0, 1.0, -1.0, 0.5), (0.0, 1.0, 1.0, math.nan)],
)
def test_what_cannot_be_is_refused(low: float, high: float, weight: float, friction: float) -> None:
    with pytest.raises(InputError, match="grip: want"):
        gentlest_grip(squeezed(1.0, 0.5), low, high, weight=weight, friction=friction)


def test_what_slid_tells_how_firm_a_grip_has_to_be() -> None:
    """An object that rides along: capacities are those before the weight comes on, and a grip holds from 1.5 on.

    A trial in which every point slid bore what it could, so that the next grip is aimed at.
    """

    def hold(grip: float) -> Trial:
        capacity = (grip / 1e-3) ** 2
        outcome = TrialOutcome.HELD if capacity >= 1.5 else TrialOutcome.SLIDES
        borne = capacity / 1.5 if outcome is TrialOutcome.SLIDES else 0.8 * capacity
        return Trial(outcome, 1.0, capacity, borne, capacity=capacity, pressed=capacity)

    found = gentlest_grip(hold, 0.0, 5e-3, weight=1.0, friction=0.6, start=1e-3, tolerance=0.1)
    assert found.status is GripStatus.HELD
    assert 1.5 <= found.trial.capacity <= 1.5 * 1.1
    assert len(found.trials) <= 4


def test_a_slope_that_is_not_kept_is_not_followed() -> None:
    """An object that turns away from a digit: its capacity stays below the target until the others have it, though its
    derivative promises at every grip that the next hundredth reaches it."""
    bracket, tried, grip = Bracket(0.0, 60.0, 1.08, 0.5), 0, 0.5
    while tried < 30:
        value = 0.8 if grip < 2.0 else 0.8 + 40.0 * (grip - 2.0)
        tried += 1
        if value >= 1.08:
            break
        bracket.note(grip, value, 40.0, enough=False)
        ahead = bracket.next()
        assert ahead is not None
        assert ahead > grip
        grip = ahead
    assert tried <= 12  # 200 by slopes alone
    assert grip < 4.0
