from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.render import ColorScale


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


def test_refuses() -> None:
    with pytest.raises(InputError, match="low < high"):
        ColorScale(1, 1)
    with pytest.raises(InputError, match="did you mean viridis"):
        ColorScale(0, 1, colormap="viridix").colors(np.zeros(1))
