"""Skin that rests on an obstacle does not show through it."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem.contact.solids import Plane, Sphere
from warpjld.fem.hand.visible import clear_of


def test_shallow_vertices_come_out_and_deep_ones_stay() -> None:
    ball = Sphere((0.0, 0.0, 0.0), 1.0)
    vertices = np.array([[1.2, 0, 0], [0, 0.99, 0], [0, 0, -0.5]])
    out = clear_of(vertices, [ball], 0.0, most=0.05)
    np.testing.assert_allclose(out, [[1.2, 0, 0], [0, 1.0, 0], [0, 0, -0.5]])
    np.testing.assert_array_equal(vertices[1], [0, 0.99, 0])
    rising = Plane((0, 0, 0), (0, 1, 0), motion=lambda time: ((0, time, 0), (0, 0, 0, 1)))
    np.testing.assert_allclose(clear_of(np.zeros((1, 3)), [rising], 0.01, most=0.05), [[0, 0.01, 0]])
    with pytest.raises(InputError, match="depth above 0 m"):
        clear_of(vertices, [ball], 0.0, most=0.0)
