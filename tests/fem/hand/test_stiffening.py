"""The way to a force, where its law is known."""

from __future__ import annotations

import math

import pytest

from warpjld.fem.hand.stiffening import ForceSlope, way_to


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("share", [0.2, 0.5, 3.0])
def test_two_slopes_tell_a_power_law(power: float, share: float) -> None:
    def at(way: float) -> ForceSlope:
        return ForceSlope(7.0 * way**power, 7.0 * power * way ** (power - 1.0))

    now = at(0.3)
    wanted = share * now.force
    assert 0.3 + way_to(wanted, now, at(0.22)) == pytest.approx((wanted / 7.0) ** (1.0 / power), rel=1e-9)
    assert 0.3 + way_to(wanted, now, power=power) == pytest.approx((wanted / 7.0) ** (1.0 / power), rel=1e-9)


@pytest.mark.parametrize("share", [0.2, 0.5, 3.0])
def test_exponential_growth(share: float) -> None:
    now, before = (ForceSlope(math.exp(4.0 * way), 4.0 * math.exp(4.0 * way)) for way in (0.3, 0.2))
    assert way_to(share * now.force, now) == pytest.approx(math.log(share) / 4.0)
    assert way_to(share * now.force, now, before) == pytest.approx(math.log(share) / 4.0, rel=1e-3)


def test_flesh_that_bottoms_out() -> None:
    """F = eᵗ, t = 4 x + 3 x²: F / F′ falls. To the force of a place between, and a little beyond."""
    now, before = (
        ForceSlope(math.exp(4 * x + 3 * x * x), (4 + 6 * x) * math.exp(4 * x + 3 * x * x)) for x in (0.3, 0.2)
    )
    for x in (0.25, 0.2, 0.1):
        wanted = math.exp(4 * x + 3 * x * x)
        assert 0.3 + way_to(wanted, now, before) == pytest.approx(x, abs=0.004)
