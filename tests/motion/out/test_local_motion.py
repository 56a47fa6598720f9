"""Translation, rotation and scale of nodes, put together again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.motion.out.local_motion import LocalMotion, local_motion, rest_scales

PARENTS = np.array([2, 0, -1, 2, 3])  # in no order
ALL = np.ones(5, dtype=bool)


def rigid(draw: np.random.Generator, *shape: int) -> NDArray[np.float64]:
    out = np.tile(np.eye(4), (*shape, 1, 1))
    out[..., :3, :3] = (
        Rotation.from_rotvec(draw.normal(size=(*shape, 3)).reshape(-1, 3)).as_matrix().reshape(*shape, 3, 3)
    )
    out[..., :3, 3] = draw.normal(size=(*shape, 3))
    return out


def together(local: LocalMotion, scales: NDArray[np.float64]) -> NDArray[np.float64]:
    """World transforms (f, N, 4, 4) of what was split."""
    frames, count = local.translations.shape[:2]
    out = np.zeros((frames, count, 4, 4))
    for f in range(frames):
        for n in (2, 0, 1, 3, 4):
            own = np.eye(4)
            own[:3, :3] = Rotation.from_quat(local.rotations[f, n]).as_matrix() @ np.diag(scales[n])
            own[:3, 3] = local.translations[f, n]
            out[f, n] = out[f, PARENTS[n]] @ own if PARENTS[n] >= 0 else own
    return out


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.floats(0.01, 100.0), st.booleans())
def test_split_and_put_together(seed: int, scale: float, mirrored: bool) -> None:
    """Any rigid motions of nodes under evenly scaled ones, mirrored or not."""
    draw = np.random.default_rng(seed)
    rest = rigid(draw, 5)
    rest[2, :3, :3] *= scale
    if mirrored:
        rest[2, :3, 0] *= -1.0
    rest[4, :3, :3] = rest[4, :3, :3] @ np.diag([1.0, 2.0, 0.5])  # nothing hangs on it
    at_rest = np.empty((5, 4, 4))
    for n in (2, 0, 1, 3, 4):
        at_rest[n] = at_rest[PARENTS[n]] @ rest[n] if PARENTS[n] >= 0 else rest[n]
    worlds = rigid(draw, 3, 5) @ at_rest
    scales = rest_scales(rest)
    local = local_motion(worlds, PARENTS, rest, scales, ALL)
    np.testing.assert_allclose(together(local, scales), worlds, atol=1e-9 * max(1.0, scale))
    assert local.sheared.max() < 1e-9


def test_what_is_not_given_hangs_on_its_parent() -> None:
    draw = np.random.default_rng(1)
    rest, worlds = rigid(draw, 5), rigid(draw, 2, 5)
    given_nodes = np.array([False, True, True, True, True])
    local = local_motion(worlds, PARENTS, rest, np.ones((5, 3)), given_nodes)
    shown = together(local, np.ones((5, 3)))
    np.testing.assert_allclose(shown[:, 1:], worlds[:, 1:], atol=1e-12)
    np.testing.assert_allclose(shown[:, 0], worlds[:, 2] @ rest[0], atol=1e-12)


def test_shear_keeps_places() -> None:
    draw = np.random.default_rng(2)
    rest, worlds = rigid(draw, 5), rigid(draw, 2, 5)
    scales = np.ones((5, 3))
    scales[2] = (1.0, 3.0, 1.0)
    rest[2, :3, :3] = rest[2, :3, :3] @ np.diag(scales[2])
    worlds[:, 2] = worlds[:, 2] @ np.diag([1.0, 3.0, 1.0, 1.0])
    local = local_motion(worlds, PARENTS, rest, scales, ALL)
    np.testing.assert_allclose(together(local, scales)[..., :3, 3], worlds[..., :3, 3], atol=1e-12)
    assert local.sheared[[0, 3]].min() > 0.1


@pytest.mark.parametrize("node", [2, 3])
def test_nodes_without_size_stay_finite(node: int) -> None:
    draw = np.random.default_rng(3)
    rest = rigid(draw, 5)
    scales = np.ones((5, 3))
    scales[node] = 0.0
    rest[node, :3, :3] = 0.0
    local = local_motion(rigid(draw, 2, 5) @ rest, PARENTS, rest, scales, ALL)
    for part in (local.translations, local.rotations, local.sheared):
        assert np.isfinite(part).all()
