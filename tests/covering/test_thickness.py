"""Thickness of the flesh, and its mean over the surface around."""

import numpy as np
import pytest

from tests.covering.tube import tube
from warpjld.covering import bind
from warpjld.covering.thickness import mean_thickness, thickness
from warpjld.geometry.surface import Surface
from warpjld.skeleton import Skeleton, default_limits

RADIUS = 0.04


def limb(aside: float) -> tuple[Surface, Skeleton]:
    """A tube along -z of two segments whose bones lie ``aside`` [m] of its axis, towards +x."""
    parents = np.array([-1, 0, 1], dtype=np.int32)
    rest = np.array([[aside, 0.0, 0.0], [aside, 0.0, -0.2], [aside, 0.0, -0.4]])
    names = ("left.shoulder", "left.elbow", "left.wrist")
    skeleton = Skeleton(names, parents, rest, np.tile([0.0, 1.0, 0.0], (3, 1)), default_limits(names))
    return tube(41, radius=RADIUS, segment=0.2), skeleton


def sides(surface: Surface, values: np.ndarray) -> tuple[float, float]:
    """Values half-way along the tube on the side of +x and on the other."""
    x, y, z = surface.vertices.T
    middle = (np.abs(z + 0.2) < 0.05) & (np.abs(y) < 1e-6)
    return float(values[middle & (x > 0.0)].mean()), float(values[middle & (x < 0.0)].mean())


def test_skin_near_a_bone_is_as_thick_as_the_limb() -> None:
    surface, skeleton = limb(0.02)
    covering = bind(skeleton, surface)
    own = thickness(covering.anchors, skeleton.rest)
    near, far = sides(surface, own)
    assert near == pytest.approx(RADIUS - 0.02, rel=0.05)
    assert far == pytest.approx(RADIUS + 0.02, rel=0.05)
    mean = mean_thickness(surface.vertices, surface.faces, own)
    near, far = sides(surface, mean)
    assert near > 0.8 * RADIUS
    assert far == pytest.approx(RADIUS + 0.02, rel=0.35)
    near, far = sides(surface, covering.diffusion.radius)
    assert near > 0.8 * RADIUS
    assert far >= RADIUS + 0.015  # where flesh is thick it is not taken for thinner


def test_the_mean_of_one_thickness_is_that_thickness() -> None:
    surface, skeleton = limb(0.0)
    own = thickness(bind(skeleton, surface).anchors, skeleton.rest)
    near, far = sides(surface, mean_thickness(surface.vertices, surface.faces, own))
    assert near == pytest.approx(RADIUS, rel=0.03)
    assert far == pytest.approx(near, rel=1e-3)


def test_digits_keep_their_own() -> None:
    surface, skeleton = limb(0.02)
    names = ("left.index.base", "left.index.knuckle2", "left.index.tip")
    finger = Skeleton(names, skeleton.parents, skeleton.rest, skeleton.axes, default_limits(names))
    covering = bind(finger, surface)
    np.testing.assert_allclose(covering.diffusion.radius, thickness(covering.anchors, finger.rest), rtol=1e-9)
