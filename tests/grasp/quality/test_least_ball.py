"""The bound of epsilon by which six linear programs are saved holds."""

import numpy as np
import pytest

from warpjld.grasp.quality import Contacts, force_closure, gravity_displacement, least_resistance
from warpjld.grasp.quality import gravity as page
from warpjld.grasp.quality.gravity import _least_ball


def contacts_of(seed: int) -> Contacts:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(rng.integers(2, 8), 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = -points + 0.3 * rng.normal(size=points.shape)
    return Contacts(0.05 * points, normals, np.array(rng.uniform(0.1, 1.0)), np.full(len(points), 0.004))


@pytest.mark.parametrize("seed", range(30))
def test_it_is_never_above_epsilon(seed: int) -> None:
    contacts = contacts_of(seed)
    margin = force_closure(contacts, np.zeros(3), torque_scale=0.05).margin
    bound = _least_ball(contacts, np.zeros(3), 0.05, 8, margin)
    assert (bound > 0.0) == (margin > 0.0)
    assert bound <= least_resistance(contacts, np.zeros(3), torque_scale=0.05) + 1e-9


@pytest.mark.parametrize("seed", range(10))
def test_what_is_held_is_the_same_without_it(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    contacts = contacts_of(seed)
    how = {"mass": 0.1, "torque_scale": 0.05, "squeeze": 3.0}
    with_it = gravity_displacement(contacts, np.zeros(3), **how)
    monkeypatch.setattr(page, "_SURE", np.inf)
    without = gravity_displacement(contacts, np.zeros(3), **how)
    assert np.array_equal(with_it.held, without.held)
    assert np.array_equal(with_it.displacements, without.displacements)
