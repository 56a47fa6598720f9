"""Derivatives against central differences of the float64 oracle."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from tests.covering import oracle_smooth as oracle
from tests.covering.poses import random_poses
from warpjld.covering import Covering, Parameters
from warpjld.covering.gradient import Differentiable
from warpjld.errors import InputError

RELATIVE = 1e-4  # float32: sums of opposite signs over some 100 vertices and frames lose two or three digits
STEP = 1e-5  # of the differences, in float64: rounding 1e-10, truncation below that

POSE = {
    "positions": "positions",
    "halfway": "halfway",
    "rotations": "rotations",
    "flexion_ratio": "ratio",
    "closing": "closing",
}


class Case:
    """Two vertices of every operator, two poses, a random adjoint and the oracle's value of their product."""

    def __init__(self, covering: Covering) -> None:
        rng = np.random.default_rng(4)
        strongest = covering.domains.argmax(axis=1)
        pools = [np.flatnonzero(strongest == f) for f in range(len(covering.fans))]
        self.vertices = np.concatenate([rng.choice(p, min(len(p), 2), replace=False) for p in pools if len(p)])
        self.covering = covering
        self.poses = random_poses(covering.skeleton, 2, 7)
        self.oracle = oracle.Diffused(covering)
        self.frames = oracle.frames(covering, self.poses)
        self.adjoint = rng.normal(size=(2, len(self.vertices), 3)).astype(np.float32)
        self.operator = Differentiable(covering, self.poses, self.vertices)
        self.points = self.operator.forward()
        self.gradients = self.operator.backward(self.adjoint)

    def value(self, parameters: Parameters, frames: list[oracle.Frame]) -> float:
        points = self.oracle.points(self.vertices.tolist(), frames, parameters)
        return float((points * self.adjoint).sum())


@pytest.fixture(scope="module")
def case(bound: Covering) -> Case:
    """Muscles, which are left to the animator by default, are in use."""
    return Case(bound.with_parameters(replace(bound.parameters, muscle=np.full(len(bound.skeleton), 0.15))))


def test_forward_is_the_deformation(case: Case) -> None:
    wanted = case.covering.points(case.poses, case.vertices)
    np.testing.assert_array_equal(case.points, wanted)


@pytest.mark.parametrize("name", [f.name for f in fields(Parameters)])
def test_parameters(case: Case, name: str) -> None:
    got = getattr(case.gradients.parameters, name)
    assert np.abs(got).max() > 0.0
    base = getattr(case.covering.parameters, name)
    rng = np.random.default_rng(1)
    for direction in _directions(rng, got):
        ends = (replace(case.covering.parameters, **{name: base + s * STEP * direction}) for s in (1, -1))
        difference = np.subtract(*(case.value(p, case.frames) for p in ends)) / (2 * STEP)
        assert (got * direction).sum() == pytest.approx(difference, rel=RELATIVE, abs=_noise(got, direction))


@pytest.mark.parametrize("name", list(POSE))
def test_pose(case: Case, name: str) -> None:
    got = getattr(case.gradients.pose, name)
    assert np.abs(got).max() > 0.0
    rng = np.random.default_rng(2)
    for direction in _directions(rng, got):
        moved = [
            [
                replace(f, **{POSE[name]: getattr(f, POSE[name]) + s * STEP * d})
                for f, d in zip(case.frames, direction, strict=True)
            ]
            for s in (1, -1)
        ]
        difference = np.subtract(*(case.value(case.covering.parameters, m) for m in moved)) / (2 * STEP)
        assert (got * direction).sum() == pytest.approx(difference, rel=RELATIVE, abs=_noise(got, direction))


def test_a_step_down_the_gradient_lowers_a_cost(bound: Covering) -> None:
    poses = random_poses(bound.skeleton, 3, 11)
    begin = replace(bound.parameters, muscle=np.full(len(bound.skeleton), 0.15))
    goal = bound.with_parameters(replace(begin, muscle=1.5 * begin.muscle)).deform(poses)
    operator = Differentiable(bound.with_parameters(begin), poses)
    residual = operator.forward() - goal
    slope = operator.backward(2 * residual).parameters.muscle
    cost = float((residual**2).sum())
    step = 0.1 * cost / float(slope @ slope)
    better = replace(begin, muscle=np.maximum(begin.muscle - step * slope, 0.0))
    predicted = cost - float(slope @ (begin.muscle - better.muscle))
    assert float(((operator.forward(better) - goal) ** 2).sum()) == pytest.approx(predicted, rel=0.01)
    assert predicted < cost


def test_backward_twice_gives_the_same(case: Case) -> None:
    np.testing.assert_array_equal(
        case.operator.backward(case.adjoint).parameters.muscle, case.gradients.parameters.muscle
    )


def test_misuse_is_named(bound: Covering) -> None:
    poses = random_poses(bound.skeleton, 1, 0)
    operator = Differentiable(bound, poses, [3, 4])
    with pytest.raises(InputError, match="call forward first"):
        operator.backward(np.zeros((1, 2, 3)))
    operator.forward()
    with pytest.raises(InputError, match=r"want shape \(1, 2, 3\)"):
        operator.backward(np.zeros((2, 3)))
    with pytest.raises(InputError, match="vertices"):
        Differentiable(bound, poses, [-1])


def _directions(rng: np.random.Generator, gradient: np.ndarray) -> list[np.ndarray]:
    """Two random directions, and the single entries that matter most."""
    out = [rng.normal(size=gradient.shape) for _ in range(2)]
    for flat in np.argsort(-np.abs(gradient).ravel())[:2]:
        one = np.zeros(gradient.size)
        one[flat] = 1.0
        out.append(one.reshape(gradient.shape))
    return out


def _noise(gradient: np.ndarray, direction: np.ndarray) -> float:
    """Sums of opposite signs keep the rounding error of their terms."""
    return 1e-6 * float(np.linalg.norm(gradient) * np.linalg.norm(direction))
