"""Digits that share a force as their strengths do, on pads whose forces are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.simulation.grip.force import ForceStatus
from warpjld.simulation.grip.pressed_digits import PressedDigits
from warpjld.simulation.grip.shared_force import SharedGrip, share_force

Array = NDArray[np.float64]

STRENGTHS = np.array([69.0, 59.0, 82.0, 59.0, 33.0])
"""[N]; thumb to little finger."""
START = 0.01


def pads(
    touch: Array,
    power: float = 2.0,
    lever: float = 1.0,
    coupling: float = 0.0,
    slopes: bool = True,
    strengths: Array = STRENGTHS,
) -> Callable[[Array], PressedDigits]:
    """Pads that press with a power of their ways beyond the first touch, each way less by what neighbours press; a
    ``lever`` below 1 makes the object lie nearer to the joints, so that the same share presses more."""
    stiff = 5e4 * np.linspace(1.0, 3.0, len(touch))  # [N / rad^2]
    pushed = np.eye(len(touch)) - coupling * (np.eye(len(touch), k=1) + np.eye(len(touch), k=-1))

    def press(grips: Array) -> PressedDigits:
        way = np.maximum(pushed @ (grips - touch), 0.0)
        forces = stiff * way**power
        rise = power * stiff * way ** (power - 1.0)
        shares = lever * forces / strengths
        return PressedDigits(forces, shares, (lever * rise / strengths)[:, None] * pushed if slopes else None)

    return press


def shared(press: Callable[[Array], PressedDigits], force: float, room: float = 0.4, **options: float) -> SharedGrip:
    strengths = options.pop("strengths", STRENGTHS)  # type: ignore[arg-type]
    count = len(np.atleast_1d(strengths))
    return share_force(press, np.full(count, -room), np.full(count, room), strengths, force, start=START, **options)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("coupling", [0.0, 0.2])
@pytest.mark.parametrize("force", [5.0, 40.0, 200.0])
def test_digits_that_touch_share_as_they_are_strong_in_six_trials(power: float, coupling: float, force: float) -> None:
    found = shared(pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3, -2e-3]), power, coupling=coupling), force)
    assert found.status is ForceStatus.REACHED
    assert found.pressed is not None
    assert found.pressed.forces.sum() == pytest.approx(force, rel=0.02)
    np.testing.assert_allclose(found.pressed.forces / force, STRENGTHS / STRENGTHS.sum(), rtol=0.08)
    assert len(found.trials) <= 6
    assert found.left_out == ()


def test_first_touches_do_not_decide() -> None:
    """Digits that are 0 to 6 degrees off: all close until they press alike."""
    found = shared(pads(np.radians([0.0, 6.0, 1.0, 3.0, 5.0])), 12.5)
    assert found.status is ForceStatus.REACHED
    assert found.pressed is not None
    np.testing.assert_allclose(found.pressed.forces / 12.5, STRENGTHS / STRENGTHS.sum(), rtol=0.08)
    assert len(found.trials) <= 12


def test_a_digit_goes_to_where_it_should_touch_at_once() -> None:
    """Solving contact at every step on the way is what takes longest."""
    touch = np.radians([0.0, 0.0, 0.0, 0.0, 17.0])
    found, blind = (shared(pads(touch), 12.5, **more) for more in ({"touch": touch}, {}))  # type: ignore[arg-type]
    assert found.status is blind.status is ForceStatus.REACHED
    np.testing.assert_allclose(found.pressed.forces / 12.5, STRENGTHS / STRENGTHS.sum(), rtol=0.08)  # type: ignore[union-attr]
    assert len(found.trials) <= len(blind.trials) - 2
    ways = np.array([at[4] for at, _ in found.trials])
    assert not ((ways > 0.0) & (ways < touch[4])).any()


def test_a_digit_that_passes_by_is_left_out() -> None:
    """The last one should touch after 2 degrees, and presses on nothing however far it closes."""
    touch = np.radians([0.0, 0.0, 0.0, 0.0, 2.0])
    found = shared(pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3, 9.0])), 20.0, touch=touch)  # type: ignore[arg-type]
    assert found.status is ForceStatus.REACHED
    assert found.left_out == (4,)
    assert max(at[4] for at, _ in found.trials) < 0.2  # of 0.4 rad of room
    rest = np.delete(found.pressed.forces, 4)  # type: ignore[union-attr]
    np.testing.assert_allclose(rest / 20.0, STRENGTHS[:4] / STRENGTHS[:4].sum(), rtol=0.08)


def test_levers_decide_not_forces() -> None:
    """Two digits of one strength; the object lies half as far from the joints of the second, which presses twice as
    hard with the same share."""
    strengths = np.array([50.0, 50.0])
    lever = np.array([1.0, 0.5])
    found = shared(pads(np.full(2, -1e-3), lever=lever, strengths=strengths), 30.0, strengths=strengths)  # type: ignore[arg-type]
    assert found.status is ForceStatus.REACHED
    assert found.pressed is not None
    assert found.pressed.forces[1] / found.pressed.forces[0] == pytest.approx(2.0, rel=0.1)


def test_without_slopes_secants_find_it() -> None:
    found = shared(pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3, -2e-3]), slopes=False), 20.0)
    assert found.status is ForceStatus.REACHED


def test_a_digit_that_presses_too_hard_opens() -> None:
    found = shared(pads(np.array([-3e-2, -1e-3, -2e-3, -4e-3, -2e-3])), 20.0)  # the thumb presses with 45 N
    assert found.status is ForceStatus.REACHED
    assert found.grips[0] < 0.0


def test_a_digit_that_does_not_reach_is_left_out() -> None:
    found = shared(pads(np.array([-3e-3, -1e-3, 1.0, -4e-3, -2e-3])), 20.0)
    assert found.status is ForceStatus.REACHED
    assert found.left_out == (2,)
    assert found.pressed is not None
    rest = np.delete(found.pressed.forces, 2)
    np.testing.assert_allclose(rest / 20.0, np.delete(STRENGTHS, 2) / np.delete(STRENGTHS, 2).sum(), rtol=0.08)


def test_a_digit_that_slips_off_is_left_out_where_it_pressed_most() -> None:
    """The last one passes the end of the handle: it presses a little, then less, then on nothing."""
    others = pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3, 1.0]))
    tried: list[float] = []

    def press(grips: Array) -> PressedDigits:
        found, way = others(grips), float(grips[4])
        tried.append(way)
        force = max(0.0, 2.0 * (way / 0.1) * (1.0 - way / 0.2))  # at most 0.5 N, of 4.4 N that would be its share
        slope = 2.0 / 0.1 * (1.0 - way / 0.1) if 0.0 <= way < 0.2 else 0.0
        forces, shares, slopes = found.forces.copy(), found.shares.copy(), np.array(found.slopes)
        forces[4], shares[4], slopes[4, 4] = force, force / STRENGTHS[4], slope / STRENGTHS[4]
        return PressedDigits(forces, shares, slopes)

    found = shared(press, 40.0)
    assert found.status is ForceStatus.REACHED
    assert found.left_out == (4,)
    assert found.pressed is not None
    assert found.pressed.forces.sum() == pytest.approx(40.0, rel=0.02)
    assert found.pressed.forces[4] == max(2.0 * (way / 0.1) * (1.0 - way / 0.2) for way in tried)
    assert found.grips[4] < 0.2  # of the 0.4 that it may close
    assert len(found.trials) <= 12


def test_a_digit_that_presses_on_its_neighbour_alone_is_left_out() -> None:
    """Its force hardly grows however far it bends."""
    good = pads(np.array([-3e-3, -1e-3, 1.0, -4e-3, -2e-3]))

    def press(grips: Array) -> PressedDigits:
        found = good(grips)
        found.shares[2] = 1e-3 * (1.0 + grips[2])
        found.forces[2] = STRENGTHS[2] * found.shares[2]
        assert found.slopes is not None
        found.slopes[2, 2] = 1e-3
        return found

    found = shared(press, 20.0)
    assert found.status is ForceStatus.REACHED
    assert found.left_out == (2,)
    assert len(found.trials) <= 10


@pytest.mark.parametrize(
    ("touch", "force", "status"),
    [
        (1.0, 20.0, ForceStatus.NO_CONTACT),
        (-1e-3, 400.0, ForceStatus.TOO_WEAK),
        (0.399, 40.0, ForceStatus.LIMIT),
    ],
)
def test_why_there_is_none(touch: float, force: float, status: ForceStatus) -> None:
    assert shared(pads(np.full(5, touch)), force).status is status


def test_a_thumb_that_alone_opposes_shares_as_nearly_as_it_can() -> None:
    """On a free object a thumb presses with what all fingers do together, whatever the closings."""
    free = pads(np.array([-1e-3, -1e-3]), strengths=np.array([69.0, 233.0]))

    def press(grips: Array) -> PressedDigits:
        at = free(np.full(2, grips.mean()))
        force = at.forces[0]
        slope = 2.0 * force / (grips.mean() + 1e-3) / 2.0
        strengths = np.array([69.0, 233.0])
        return PressedDigits(np.full(2, force), force / strengths, np.outer(slope / strengths, np.ones(2)))

    found = shared(press, 20.0, strengths=np.array([69.0, 233.0]))  # type: ignore[arg-type]
    assert found.status is ForceStatus.UNEVEN
    assert found.pressed is not None
    assert found.pressed.forces.sum() == pytest.approx(20.0, rel=0.02)


def test_equilibria_that_are_not_found_end_the_search() -> None:
    good = pads(np.full(5, -1e-3))

    def press(grips: Array) -> PressedDigits | None:
        return good(grips) if grips.max() < 1e-4 else None

    found = shared(press, 20.0)
    assert found.status is ForceStatus.NO_SOLUTION
    assert np.abs(found.grips).max() < 1e-4


def test_what_was_tried_is_kept_when_interrupted() -> None:
    good = pads(np.full(5, -1e-3))

    def press(grips: Array) -> PressedDigits:
        if grips.max() > 1e-4:
            raise KeyboardInterrupt
        return good(grips)

    found = shared(press, 20.0)
    assert found.status is ForceStatus.INTERRUPTED
    assert len(found.trials) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"force": 0.0}, "force, strengths and step above 0"),
        ({"start": 0.0}, "force, strengths and step above 0"),
        ({"low": [0.1, -1.0]}, "ranges"),
        ({"low": [], "high": [], "strengths": []}, "ranges"),
    ],
)
def test_wrong_numbers_are_refused(change: dict[str, object], message: str) -> None:
    wanted: dict[str, object] = {"low": [-1.0, -1.0], "high": [1.0, 1.0], "strengths": [1.0, 1.0], "force": 1.0}
    with pytest.raises(InputError, match=message):
        share_force(pads(np.zeros(2)), **{"start": 0.01} | wanted | change)  # type: ignore[arg-type]


@pytest.mark.parametrize("promised", [2.0, 3.0])
def test_slopes_that_promise_too_much_are_corrected_by_what_came_of_them(promised: float) -> None:
    """Slopes are those of skin that sticks; where it slips as a digit closes on, its force rises by less."""
    press = pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3, -2e-3]))

    def slipping(grips: Array) -> PressedDigits:
        found = press(grips)
        assert found.slopes is not None
        return PressedDigits(found.forces, found.shares, promised * found.slopes)

    found = shared(slipping, 40.0)
    assert found.status is ForceStatus.REACHED
    assert len(found.trials) <= 8


def test_a_digit_that_should_hardly_press_does_not_keep_the_search_going() -> None:
    """The last is to press with a hundredth of what others do, and presses with what the first presses on it."""
    strengths = np.array([2.0, 1.0, 1.0, 0.01])
    press = pads(np.array([-3e-3, -1e-3, -2e-3, -4e-3]), strengths=strengths)

    def carried(grips: Array) -> PressedDigits:
        found = press(grips)
        assert found.slopes is not None
        forces, shares, slopes = found.forces.copy(), found.shares.copy(), found.slopes.copy()
        forces[3] = 0.05 * forces[0]
        shares[3] = forces[3] / strengths[3]
        slopes[3] = 0.1
        return PressedDigits(forces, shares, slopes, load=0.1)

    found = shared(carried, 3.0, strengths=strengths, even=0.25)  # type: ignore[arg-type]
    assert found.status is ForceStatus.REACHED
    assert len(found.trials) <= 6
