"""Kochanek–Bartels in-betweens: the properties the paper promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from warpjld.errors import InputError
from warpjld.motion import Spline

EXACT = 1e-9
"""Rounding of cubics with values and slopes below 1e3 on intervals of 0.1 to 30 frames."""

constants = st.floats(-1, 1)
values = st.floats(-10, 10).map(lambda value: round(value, 6))


@st.composite
def keys(draw: st.DrawFn, least: int = 1) -> tuple[np.ndarray, np.ndarray]:
    count = draw(st.integers(least, 7))
    gaps = draw(arrays(float, count, elements=st.floats(0.1, 30)))
    return np.cumsum(gaps), draw(arrays(float, count, elements=values))


@settings(max_examples=40)
@given(keys(), constants, constants, constants)
def test_goes_through_its_keys_and_holds_outside(data: tuple, t: float, c: float, b: float) -> None:
    spline = Spline(*data, t, c, b)
    np.testing.assert_allclose(spline(data[0]), data[1], atol=EXACT)
    np.testing.assert_allclose(spline([data[0][0] - 5, data[0][-1] + 5]), data[1][[0, -1]], atol=EXACT)


@settings(max_examples=40)
@given(keys(least=3), constants, constants)
def test_speed_is_continuous_where_continuity_is_zero(data: tuple, t: float, b: float) -> None:
    spline = Spline(*data, tension=t, bias=b)
    inner = data[0][1:-1]
    np.testing.assert_allclose(
        spline.derivative(np.nextafter(inner, -np.inf)), spline.derivative(inner), atol=1e-6, rtol=1e-9
    )


def test_continuity_makes_a_corner() -> None:
    for continuity in (0.5, -0.5):
        spline = Spline([0, 1, 3], [0, 1, 0], continuity=[0, continuity, 0])
        jump = spline.derivative(1.0) - spline.derivative(np.nextafter(1.0, 0.0))
        assert jump == pytest.approx(continuity * 2.0 / 1.5), "c times twice the chord, over the mean interval"


@settings(max_examples=40)
@given(keys(least=2), st.floats(-3, 3), st.floats(-5, 5))
def test_a_line_stays_a_line_however_keys_are_spaced(data: tuple, slope: float, start: float) -> None:
    times = data[0]
    dense = np.linspace(times[0], times[-1], 50)
    got = Spline(times, start + slope * times, hold=False)(dense)
    np.testing.assert_allclose(got, start + slope * dense, atol=1e-8)


@settings(max_examples=40)
@given(keys(), constants, constants, constants, st.floats(0.25, 4), st.floats(-3, 3))
def test_affine_invariance(data: tuple, t: float, c: float, b: float, scale: float, shift: float) -> None:
    times, key_values = data
    dense = np.linspace(times[0], times[-1], 40)
    plain = Spline(times, key_values, t, c, b, hold=False)(dense)
    moved = Spline(scale * times + shift, shift - 2.5 * key_values, t, c, b, hold=False)(scale * dense + shift)
    np.testing.assert_allclose(moved, shift - 2.5 * plain, atol=1e-8)


@settings(max_examples=40)
@given(arrays(float, 5, elements=values))
def test_is_catmull_rom_on_even_keys(key_values: np.ndarray) -> None:
    spline = Spline(np.arange(5.0), key_values, hold=False)
    a, b, c, d = key_values[:4]
    u = np.linspace(0, 1, 11)
    expected = 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)
    np.testing.assert_allclose(spline(1 + u), expected, atol=EXACT)


def test_tension_one_stops_and_eases() -> None:
    spline = Spline([0, 10], [0, 1], tension=1)
    u = np.linspace(0, 1, 5)
    np.testing.assert_allclose(spline(10 * u), 3 * u**2 - 2 * u**3, atol=1e-12)


def test_bias_overshoots_after_or_before_the_key() -> None:
    times, key_values = [0, 10, 20, 30], [0, 1, 1.01, 0]
    after, before = (Spline(times, key_values, bias=b)([7.0, 13.0]) for b in (1, -1))
    assert after[1] > before[1]
    assert after[0] < before[0]


def test_equal_neighbours_hold_with_default_constants_only() -> None:
    times, key_values = [0, 10, 20, 30], [0, 0, 1, 1]
    dense = np.linspace(0, 30, 301)
    held = Spline(times, key_values)(dense)
    assert held.min() == 0.0
    assert held.max() <= 1.0 + 1e-12
    assert np.ptp(held[dense <= 10]) == 0.0
    assert Spline(times, key_values, hold=False)(dense).min() < -0.01
    assert Spline(times, key_values, bias=0.1)(dense).min() < -0.01


@pytest.mark.parametrize(
    ("times", "key_values", "message"),
    [
        ([], [], "at least one"),
        ([0, 1], [0], "as many times as values"),
        ([0, 2, 2], [0, 0, 0], "2 does not"),
        ([0, 1], [0, np.nan], "finite"),
    ],
)
def test_bad_keys_are_explained(times: list, key_values: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Spline(times, key_values)


def test_wrong_number_of_constants() -> None:
    with pytest.raises(InputError, match="tension needs one finite number or 2"):
        Spline([0, 1], [0, 1], tension=[0, 0, 0])


@given(st.floats(-3, 3), st.floats(-1e-6, 1e-6))
def test_neighbours_that_are_nearly_equal_give_nearly_the_same_curve(level: float, off: float) -> None:
    times, dense = np.array([0.0, 1.0, 3.0, 4.0]), np.linspace(0.0, 4.0, 81)
    held = Spline(times, [0.0, level, level, 1.0])(dense)
    np.testing.assert_allclose(Spline(times, [0.0, level, level + off, 1.0])(dense), held, atol=2e3 * abs(off) + 1e-9)
