"""Balance of contact springs: Newton's method for many loads beside SciPy's trust region for one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.grasp.quality.sets import four_on_box, ring_on_sphere, two_on_sphere
from warpjld.grasp.quality import grasp_matrix
from warpjld.grasp.quality.contact_springs import BALANCED, ContactSprings, _Potentials

_STIFFNESS = np.array([2400.0, 2400.0, 3500.0, 0.0])


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["ring", "box", "pinch"]), st.floats(0.1, 1.2), st.floats(0.0, 3.0))
def test_both_ways_find_the_same_forces(seed: int, which: str, friction: float, squeeze: float) -> None:
    contacts = {
        "ring": ring_on_sphere(0.04, friction),
        "box": four_on_box(0.02, friction),
        "pinch": two_on_sphere(0.03, friction, 0.004),
    }[which]
    springs = ContactSprings(contacts, grasp_matrix(contacts, np.zeros(3), 0.03), _STIFFNESS)
    rng = np.random.default_rng(seed)
    preload = np.zeros((len(contacts), 4))
    preload[:, 2] = squeeze * rng.uniform(0.2, 1.0, len(contacts))
    # loads that forces in the cones balance: those of moderate forces inside them
    inner = np.zeros((4, len(contacts), 4))
    inner[:, :, 2] = rng.uniform(0.5, 2.0, (4, len(contacts)))
    inner[:, :, 0] = 0.6 * friction * inner[:, :, 2] * rng.uniform(-1.0, 1.0, (4, len(contacts)))
    loads = -np.einsum("ij,dj->di", grasp_matrix(contacts, np.zeros(3), 0.03), inner.reshape(4, -1))
    _, forces, residual = springs.balance(preload, loads)
    assert (residual <= BALANCED).all()
    potentials = _Potentials(springs, preload, loads)
    for d in range(4):
        other = potentials.scaled_forces(potentials.by_trust_region(d)[None], np.array([d]))[0][0] * springs._roots
        assert forces[d] == pytest.approx(other, abs=1e-4 * np.linalg.norm(loads[d]))
