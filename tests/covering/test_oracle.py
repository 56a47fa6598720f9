"""Kernels against oracles that share no code with them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.covering import oracle_smooth
from tests.covering.poses import random_poses
from warpjld.covering import Covering, bind
from warpjld.rig import Rig

SMOOTH = 1e-6  # of the surface's size: float32 positions and coefficients


def sample(covering: Covering, each: int, seed: int) -> np.ndarray:
    """A few vertices of every operator, and those that most operators share."""
    rng = np.random.default_rng(seed)
    strongest = covering.domains.argmax(axis=1)
    pools = [np.flatnonzero(strongest == f) for f in range(len(covering.fans))]
    chosen = [rng.choice(p, min(len(p), each), replace=False) for p in pools if len(p)]
    mixed = np.argsort(covering.domains.max(axis=1))[: 3 * each]
    return np.unique(np.concatenate([*chosen, mixed]))


def smooth_error(covering: Covering, each: int) -> float:
    poses = random_poses(covering.skeleton, 4, 3, twist=0.4)
    vertices = sample(covering, each, 5)
    rest = covering.skeleton.rest
    placed = oracle_smooth.places(covering, vertices.tolist())
    wanted = np.array(
        [
            [oracle_smooth.evaluate(p, frame, covering.parameters, rest) for p in placed]
            for frame in oracle_smooth.frames(covering, poses)
        ]
    )
    got = covering.deform(poses)[:, vertices]
    return float(np.abs(got - wanted).max()) / covering.surface.size


def test_smooth_formula(bound: Covering) -> None:
    assert smooth_error(bound, 15) < SMOOTH


@pytest.mark.parametrize("side", ["left", "right"])
def test_smooth_formula_on_webxr(webxr_hands: dict[str, Rig], side: str) -> None:
    rig = webxr_hands[side]
    assert smooth_error(bind(rig.skeleton, rig.surface), 15) < SMOOTH
