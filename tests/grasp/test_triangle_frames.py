"""Frames of triangles: their corners come out where the frame says, needles and points included."""

import numpy as np
import pytest

from warpjld.grasp.triangle_frames import triangle_frames


@pytest.mark.parametrize("narrow", [1.0, 1e-3, 1e-7, 0.0])
def test_corners_lie_where_the_frame_says(narrow: float) -> None:
    rng = np.random.default_rng(5)
    a, along, across = rng.normal(size=(3, 400, 3))
    corners = np.stack([a, a + along, a + 0.3 * along + narrow * across], axis=1).astype(np.float32)
    _check(corners)


def test_triangles_that_are_edges_or_points() -> None:
    point = np.array([0.3, -2.0, 0.7])
    edge = np.array([point, point, point + 0.1])
    _check(np.stack([np.roll(edge, k, axis=0) for k in range(3)]).astype(np.float32))
    _check(np.broadcast_to(point, (1, 3, 3)).astype(np.float32))


def _check(corners: np.ndarray) -> None:
    frames = triangle_frames(corners)
    assert frames.dtype == np.float32
    assert np.isfinite(frames).all()
    axes, offset, length, second, third, error = np.split(frames.astype(np.float64), [9, 12, 13, 16, 19], axis=1)
    axes = axes.reshape(-1, 3, 3)
    turned = axes @ axes.transpose(0, 2, 1)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=3e-7)
    local = np.einsum("nki,nci->nck", axes, corners.astype(np.float64)) + offset[:, None]
    b = np.concatenate([length, 0.0 * length], axis=1)
    by_second, by_third = b + second[:, 2:] * second[:, :2], third[:, 2:] * third[:, :2]
    flat = np.stack([np.zeros_like(b), b, by_third], axis=1)
    wanted = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)
    away = np.linalg.norm(local[:, :, None] - wanted[:, None], axis=-1)
    # each corner at its own place: the first is any of them, the order that of the triangle
    orders = np.stack([away[:, np.roll(np.arange(3), -k), np.arange(3)].max(axis=1) for k in range(3)])
    assert (orders.min(axis=0) < 0.2 * error[:, 0]).all()
    assert (np.linalg.norm(by_second - by_third, axis=1) < 0.2 * error[:, 0]).all()
    assert (flat[:, 2, 1] > -0.2 * error[:, 0]).all()
    assert (length[:, 0] >= np.maximum(second[:, 2], third[:, 2]) * (1 - 1e-6)).all()
