from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.render import VIEWS, Camera


def _screen(camera: Camera, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Where points come to lie, -1…1 across the height; the oracle projects with a matrix of its own."""
    back = np.subtract(camera.position, camera.target)
    back /= np.linalg.norm(back)
    right = np.cross(camera.up, back)
    right /= np.linalg.norm(right)
    local = (points - camera.position) @ np.stack([right, np.cross(back, right), back]).T
    assert (local[:, 2] < 0).all(), "behind the camera"
    return local[:, :2] / -local[:, 2:] / math.tan(camera.angle / 2) / [size[0] / size[1], 1]


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(VIEWS)),
    st.integers(0, 10_000),
    st.floats(0.01, 100),
    st.sampled_from([(960, 720), (300, 400), (64, 64)]),
)
def test_all_points_are_framed_tightly(name: str, seed: int, extent: float, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    points = extent * rng.normal(size=(40, 3)) * rng.uniform(0.1, 1, 3) + extent * rng.normal(size=3)
    forward, up = rng.normal(size=(2, 3))
    camera = Camera.view(name, points, forward=forward, up=up, side="left", size=size, margin=0.1)
    places = np.abs(_screen(camera, points, size))
    assert places.max() == pytest.approx(0.8, abs=1e-6)


def test_hand_views_show_their_side() -> None:
    """A left hand with its fingers up and its palm towards +Z has its thumb at -X."""
    points = np.random.default_rng(0).normal(size=(20, 3))
    for name, towards in {
        "palmar": (0, 0, 1),
        "dorsal": (0, 0, -1),
        "radial": (-1, 0, 0),
        "ulnar": (1, 0, 0),
        "tips": (0, 1, 0),
    }.items():
        camera = Camera.view(name, points, side="left")
        eye = np.subtract(camera.position, camera.target)
        np.testing.assert_allclose(eye / np.linalg.norm(eye), towards, atol=1e-9)
    right = Camera.view("radial", points, side="right")
    assert right.position[0] > right.target[0]


def test_left_of_a_body_is_its_own_left() -> None:
    """A body that faces +Z with its head up has its left side at +X, whichever hand is asked about."""
    points = np.random.default_rng(0).normal(size=(20, 3))
    for side in (None, "left", "right"):
        camera = Camera.view("left", points, side=side)
        assert camera.position[0] > 2


def test_turned_all_the_way_is_back() -> None:
    camera = Camera((1.0, 2.0, 5.0), (0.0, 0.5, 0.0))
    np.testing.assert_allclose(camera.turned(2 * math.pi).position, camera.position, atol=1e-12)
    half = camera.turned(math.pi)
    np.testing.assert_allclose(half.position, (-1, 2, -5), atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"position": (0, 0, 1), "target": (0, 0, 1)}, "line of sight"),
        ({"position": (0, 5, 0), "target": (0, 0, 0)}, "line of sight"),
        ({"position": (0, 0, float("nan")), "target": (0, 0, 0)}, "finite"),
        ({"position": (0, 0, 1), "target": (0, 0, 0), "zoom": 0}, "zoom"),
        ({"position": (0, 0, 1), "target": (0, 0, 0), "angle": 0}, "angle"),
    ],
)
def test_refuses(arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Camera(**arguments)


def test_unknown_view_suggests() -> None:
    with pytest.raises(InputError, match="did you mean palmar"):
        Camera.view("palmer", np.zeros((1, 3)))
    with pytest.raises(InputError, match="different directions"):
        Camera.view("palmar", np.zeros((1, 3)), forward=(0, 1, 0), up=(0, 2, 0))
