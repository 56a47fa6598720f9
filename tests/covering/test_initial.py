"""Surfaces digitised bent: they are what they were at rest, and open to what they were digitised from (R25, C24)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.covering.tube import bend, tube, tube_skeleton
from tests.skeleton.test_initial import digitised
from warpjld.covering import Covering, bind, default_parameters
from warpjld.covering.gradient import Differentiable
from warpjld.skeleton import CHANNELS, rest_poses

BENT = 50.0  # degrees
METHODS = ("smooth", "paper")


def tubes(method: str) -> tuple[Covering, Covering]:
    """A straight tube, and the same digitised bent, with inflation of joints and muscles."""
    skeleton, surface = tube_skeleton(120.0), tube(rings=41, around=24)
    parameters = replace(default_parameters(skeleton), inflation=np.full(3, 0.4), muscle=np.full(3, 0.2))
    straight = bind(skeleton, surface, method=method, parameters=parameters)
    points = straight.deform(bend(skeleton, [BENT]))[0]
    initial = np.zeros((3, len(CHANNELS)))
    initial[1, 0] = np.radians(BENT)
    bent = bind(
        digitised(skeleton, initial),
        replace(surface, vertices=points.astype(np.float64)),
        method=method,
        parameters=parameters,
        domains=straight.domains,
    )
    return straight, bent


@pytest.fixture(scope="module", params=METHODS)
def both(request: pytest.FixtureRequest) -> tuple[Covering, Covering]:
    return tubes(request.param)


def test_rest_is_exact(both: tuple[Covering, Covering]) -> None:
    _, bent = both
    np.testing.assert_allclose(bent.deform(rest_poses(bent.skeleton))[0], bent.surface.vertices, atol=1e-7)
    some = np.arange(0, len(bent.surface.vertices), 7)
    np.testing.assert_allclose(bent.points(rest_poses(bent.skeleton), some)[0], bent.surface.vertices[some], atol=1e-7)


def test_it_opens_flat(both: tuple[Covering, Covering]) -> None:
    """Nearly: where vertices lie on their segments is found at rest. Half a millimetre, where the bend was 50°."""
    straight, bent = both
    opened = bent.deform(bend(bent.skeleton, [0.0]))[0]
    away = np.linalg.norm(opened - straight.surface.vertices, axis=1)
    moved = np.linalg.norm(bent.surface.vertices - straight.surface.vertices, axis=1)
    assert moved.max() > 0.02
    assert away.max() < 1.5e-3
    assert np.sqrt((away**2).mean()) < 5e-4


def test_inflation_counts_from_straight(both: tuple[Covering, Covering]) -> None:
    """Without initial angles the digitised bend would be inflated once more."""
    straight, bent = both
    wanted = straight.deform(bend(straight.skeleton, [100.0]))[0]
    plain = replace(bent.skeleton, initial=np.zeros_like(bent.skeleton.initial))
    method = "smooth" if type(bent) is Covering else "paper"
    double = bind(plain, bent.surface, method=method, parameters=bent.parameters, domains=bent.domains)
    errors = [
        np.sqrt((np.linalg.norm(c.deform(bend(s, [angle]))[0] - wanted, axis=1) ** 2).mean())
        for c, s, angle in ((bent, bent.skeleton, 100.0), (double, plain, 50.0))
    ]
    assert errors[0] < errors[1]


def test_derivatives_follow_the_offsets() -> None:
    _, bent = tubes("smooth")
    operator = Differentiable(bent, bend(bent.skeleton, [0.0, 90.0]))
    seed = np.random.default_rng(3).normal(size=operator.forward().shape).astype(np.float32)
    operator.forward()
    slopes = operator.backward(seed).parameters
    for name in ("inflation", "muscle"):
        step = 0.02 * np.array([0.0, 1.0, 0.0])
        ends = [replace(bent.parameters, **{name: getattr(bent.parameters, name) + s * step}) for s in (1, -1)]
        values = [float((operator.forward(p).astype(np.float64) * seed).sum()) for p in ends]
        assert float(getattr(slopes, name) @ step) == pytest.approx((values[0] - values[1]) / 2, rel=5e-3)
