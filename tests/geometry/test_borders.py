"""Borders of different meshes that coincide, exactly or but for rounding, become one (R18)."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.geometry.surface import Part, Surface, weld_surface

EDGE = 0.01  # of the squares of two strips that share a border [m]
ROWS, COLUMNS = 3, 20


def _strip(first_row: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a strip of squares; its last row is the first of the next strip."""
    rows, columns = np.meshgrid(np.arange(ROWS), np.arange(COLUMNS), indexing="ij")
    vertices = EDGE * np.stack([columns, rows + first_row, 0 * rows], axis=-1).reshape(-1, 3).astype(float)
    corner = (COLUMNS * np.arange(ROWS - 1)[:, None] + np.arange(COLUMNS - 1)).ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, COLUMNS], corner[:, None] + [1, COLUMNS + 1, COLUMNS]])
    return vertices, faces


def _two(gap: float) -> Surface:
    """Two strips, the second one's vertices moved by a gap in random directions."""
    (a, faces), (b, others) = _strip(0), _strip(ROWS - 1)
    away = np.random.default_rng(3).normal(size=b.shape)
    b = b + gap * away / np.linalg.norm(away, axis=1, keepdims=True)
    half = slice(0, len(a)), slice(len(a), 2 * len(a))
    parts = tuple(
        Part(f"strip{k}", vertices, slice(k * len(faces), (k + 1) * len(faces))) for k, vertices in enumerate(half)
    )
    return weld_surface(np.concatenate([a, b]), np.concatenate([faces, others + len(a)]), parts=parts)


@pytest.mark.parametrize("gap", [0.0, 1e-8, 1e-5, 4e-5])
def test_borders_that_coincide_but_for_rounding_are_one(gap: float) -> None:
    surface = _two(gap)
    assert len(surface.vertices) == 2 * ROWS * COLUMNS - COLUMNS
    assert len(surface.faces) == 4 * (ROWS - 1) * (COLUMNS - 1)
    last, first = (ROWS - 1) * COLUMNS, ROWS * COLUMNS  # the border's rows in either strip
    np.testing.assert_array_equal(surface.weld[last : last + COLUMNS], surface.weld[first : first + COLUMNS])


def test_borders_farther_apart_stay_two() -> None:
    assert len(_two(2e-4).vertices) == 2 * ROWS * COLUMNS
