"""Kernels against oracles that share no code with them."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from tests.covering import oracle_paper, oracle_smooth
from tests.covering.poses import random_poses
from warpjld.covering import Covering, bind
from warpjld.rig import Rig
from warpjld.skeleton import Poses

RELATIVE = 1e-6  # of the surface's size: float32 positions and coefficients


def sample(covering: Covering, each: int, seed: int) -> np.ndarray:
    """A few vertices of every operator, and those that most operators share."""
    rng = np.random.default_rng(seed)
    strongest = covering.domains.argmax(axis=1)
    pools = [np.flatnonzero(strongest == f) for f in range(len(covering.fans))]
    chosen = [rng.choice(p, min(len(p), each), replace=False) for p in pools if len(p)]
    mixed = np.argsort(covering.domains.max(axis=1))[: 3 * each]
    return np.unique(np.concatenate([*chosen, mixed]))


def smooth_points(covering: Covering, poses: Poses, vertices: np.ndarray) -> np.ndarray:
    frames = oracle_smooth.frames(covering, poses)
    return oracle_smooth.Diffused(covering).points(vertices.tolist(), frames, covering.parameters)


def paper_points(covering: Covering, poses: Poses, vertices: np.ndarray) -> np.ndarray:
    placed = oracle_paper.places(covering, vertices.tolist())
    frames = [oracle_paper.Pose.of(covering.skeleton, poses, f) for f in range(len(poses))]
    return np.array([[oracle_paper.evaluate(p, f, covering.parameters) for p in placed] for f in frames])


ORACLES = {"smooth": smooth_points, "paper": paper_points}


def error(rig: Rig, method: Literal["smooth", "paper"]) -> float:
    """Largest distance from the oracle, relative to the surface's size."""
    covering = bind(rig.skeleton, rig.surface, method=method)
    covering.thickening = np.linspace(1.0, 2.0, len(covering.anchors.pairs))  # most hands have 1 only
    poses = random_poses(covering.skeleton, 6, 3, twist=0.4)
    vertices = sample(covering, 5, 5)
    wanted = ORACLES[method](covering, poses, vertices)
    return float(np.abs(covering.deform(poses)[:, vertices] - wanted).max()) / covering.surface.size


@pytest.mark.parametrize("method", ["smooth", "paper"])
def test_built_in_hand(built: Rig, method: Literal["smooth", "paper"]) -> None:
    assert error(built, method) < RELATIVE


@pytest.mark.parametrize(
    ("side", "method"), [pytest.param("right", "smooth", marks=pytest.mark.slow), ("left", "paper")]
)
def test_webxr_hand(webxr_hands: dict[str, Rig], side: str, method: Literal["smooth", "paper"]) -> None:
    assert error(webxr_hands[side], method) < RELATIVE
