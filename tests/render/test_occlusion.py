"""Depths of surfaces whose occlusion is known: none on planes and spheres, most in the groove between two."""

from __future__ import annotations

import numpy as np

from warpjld.render.occlusion import occlusion, shade

FOCAL = 200.0


def _rays(height: int = 90, width: int = 120) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.indices((height, width), dtype=float)
    return (x - width / 2) / FOCAL, (y - height / 2) / FOCAL


def _sphere(x: np.ndarray, y: np.ndarray, centre: tuple[float, float, float], radius: float) -> np.ndarray:
    """Depth where the ray (x, y, 1) t meets a sphere first; NaN where it misses."""
    a = x**2 + y**2 + 1
    b = x * centre[0] + y * centre[1] + centre[2]
    square = b**2 - a * (np.dot(centre, centre) - radius**2)
    return np.where(square >= 0, (b - np.sqrt(np.maximum(square, 0))) / a, np.nan)


def test_slanted_plane_and_nothing_are_open() -> None:
    x, y = _rays()
    plane = 1 / (1 + 0.6 * x - 0.3 * y)
    assert occlusion(plane, FOCAL, 0.1).max() < 1e-3
    assert occlusion(np.full((9, 9), np.nan), FOCAL, 0.1).max() == 0


def test_sphere_hides_nothing_of_itself() -> None:
    x, y = _rays()
    assert occlusion(_sphere(x, y, (0, 0, 1), 0.15), FOCAL, 0.1).max() < 0.02


def test_groove_is_dark_and_far_apart_is_not() -> None:
    x, y = _rays()
    left, right = _sphere(x, y, (-0.1, 0, 1), 0.1), _sphere(x, y, (0.1, 0, 1), 0.1)
    shadow = occlusion(np.fmin(left, right), FOCAL, 0.08)
    assert shadow[45, 54:66].max() > 0.3
    assert shadow[45, 35:42].max() < 0.05  # tops of the spheres
    np.testing.assert_allclose(shadow[45, 50:60], shadow[45, 61:71][::-1], atol=0.12)
    # a ball far behind another gets nothing from it
    behind = np.where(np.isfinite(left), left, _sphere(x, y, (0.15, 0, 3), 0.5))
    assert occlusion(behind, FOCAL, 0.08)[45, 70:].max() < 0.05


def test_shading_darkens_only_where_hidden() -> None:
    picture = np.full((2, 2, 3), 200, np.uint8)
    shadow = np.array([[0, 0.5], [0, 0]])
    shaded = shade(picture, shadow)
    assert (shaded[shadow == 0] == 200).all()
    assert shaded[0, 1, 0] > shaded[0, 1, 2]
    assert shaded[0, 1, 0] < 160
