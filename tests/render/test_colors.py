from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.render import ColorScale, Solid
from warpjld.render.colors import as_hex


def test_ends_and_beyond() -> None:
    scale = ColorScale(-1.0, 3.0)
    low, high, under, over = scale.colors(np.array([-1.0, 3.0, -9.0, 9.0]))
    np.testing.assert_array_equal(low, (68, 1, 84))  # viridis, as published
    np.testing.assert_array_equal(high, (253, 231, 37))
    np.testing.assert_array_equal(under, low)
    np.testing.assert_array_equal(over, high)


def test_spanning_one_value_keeps_a_width() -> None:
    scale = ColorScale.spanning([2.0, 2.0])
    assert scale.low < 2 < scale.high


def test_bar_leaves_the_left_of_the_picture_alone() -> None:
    picture = np.full((200, 300, 3), 250, np.uint8)
    drawn = ColorScale(0, 1, "stretch").drawn_on(picture, "#000000")
    np.testing.assert_array_equal(drawn[:, :180], picture[:, :180])
    assert (drawn[:, 200:] != 250).mean() > 0.02
    assert (picture == 250).all()


@pytest.mark.parametrize("size", [(640, 480), (960, 720), (600, 900)])
@pytest.mark.parametrize("high", [5.0, 281_400.0])
def test_the_bar_covers_nothing_beside_its_room(size: tuple[int, int], high: float) -> None:
    """But for the title, which stands above the bar."""
    picture = np.full((size[1], size[0], 3), 250, np.uint8)
    drawn = ColorScale.of_pressure(high).drawn_on(picture, "#000000")
    width, height = ColorScale.room_beside(size)
    right, below = (size[0] + width) // 2, round(0.24 * size[1])
    assert height == size[1]
    np.testing.assert_array_equal(drawn[below:, :right], 250)
    assert (drawn[below:, right:-1] != 250).any()
    np.testing.assert_array_equal(drawn[below:, -1], 250)  # numbers are not cut


def test_refuses() -> None:
    with pytest.raises(InputError, match="low < high"):
        ColorScale(1, 1)
    with pytest.raises(InputError, match="did you mean viridis"):
        ColorScale(0, 1, colormap="viridix").colors(np.zeros(1))


@pytest.mark.parametrize(
    ("low", "high", "factor", "texts"),
    [
        (0.0, 25_200.0, 1e-3, ["0", "5", "10", "15", "20", "25"]),
        (0.0, 1.0, 1.0, ["0", "0.2", "0.4", "0.6", "0.8", "1"]),
        (-0.003, 0.0071, 1e3, ["-2", "0", "2", "4", "6"]),
    ],
)
def test_ticks_are_round_as_written(low: float, high: float, factor: float, texts: list[str]) -> None:
    ticks = ColorScale(low, high, factor=factor).ticks()
    assert [f"{tick * factor:.3g}" for tick in ticks] == texts
    assert low <= ticks[0]
    assert ticks[-1] <= high


@pytest.mark.parametrize("high", [37.0, 10_200.0, 281_400.0, 2e7])
def test_ticks_of_pressure_are_round_and_apart(high: float) -> None:
    scale = ColorScale.of_pressure(high)
    ticks = scale.ticks(0.065)
    assert ticks[0] == 0.0
    assert ticks[-1] == high
    assert 6 <= len(ticks) <= 10
    assert np.diff(scale.shares(ticks)).min() >= 0.065
    assert all(f"{tick:.0e}"[0] in "125" for tick in ticks[1:-1])
    np.testing.assert_allclose([float(f"{tick:.0e}") for tick in ticks[1:-1]], ticks[1:-1])
    assert ticks[1] <= 0.02 * high


@pytest.mark.parametrize("share", [0.01, 0.02])
def test_a_digit_beside_one_pressed_a_hundred_times_as_much_is_seen(share: float) -> None:
    """Its colour differs from that of no pressure by more than skin's shading does; linearly it does not."""
    scale = ColorScale.of_pressure(3e5)
    none, slight = scale.colors(np.array([0.0, share * 3e5])).astype(float)
    assert np.abs(slight - none).max() > 40.0
    plain = ColorScale(0.0, 3e5, colormap=scale.colormap).colors(np.array([0.0, share * 3e5])).astype(float)
    assert np.abs(plain[1] - plain[0]).max() < 12.0


def test_no_pressure_has_a_scale() -> None:
    scale = ColorScale.of_pressure(0.0)
    np.testing.assert_array_equal(scale.colors(np.array([0.0, -1.0])), scale.table()[[0, 0]])


@pytest.mark.parametrize("name", ["LightBlue", "light blue", "#ADD8E6", "#add8e6"])
def test_colours_by_name_and_number(name: str) -> None:
    assert as_hex(name) == "#add8e6"


@pytest.mark.parametrize(
    ("name", "says"),
    [("gren", "did you mean green"), ("0.5", "no colour"), ("#12", "want a name"), ("", "no")],
)
def test_no_colours(name: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        as_hex(name)
    with pytest.raises(InputError, match=says):
        Solid(np.zeros((3, 3)), [[0, 1, 2]], color=name)
