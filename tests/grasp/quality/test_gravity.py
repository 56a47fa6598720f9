"""Displacement under gravity against springs one can solve by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.grasp.quality.sets import four_on_box, ring_on_sphere, two_on_sphere
from warpjld.errors import InputError
from warpjld.grasp.quality import SIX_DIRECTIONS, Contacts, grasp_matrix, gravity_displacement, resisted_wrench

_NORMAL, _TANGENTIAL = 3000.0, 1500.0
_STIFF = {"normal_stiffness": _NORMAL, "tangential_stiffness": _TANGENTIAL}
_WEIGHT = 0.2 * 9.81


def test_a_firm_pinch_gives_as_its_springs_do() -> None:
    """Two soft fingers squeezed hard: along their line both normal springs, across it both tangential ones."""
    pinch = two_on_sphere(0.03, 0.8, 0.004)
    answer = gravity_displacement(pinch, (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=100.0, **_STIFF)
    along, across = _WEIGHT / (2.0 * _NORMAL), _WEIGHT / (2.0 * _TANGENTIAL)
    assert answer.held.all()
    assert answer.distance == pytest.approx([along] * 2 + [across] * 4, rel=1e-5)
    moved = answer.displacements / answer.distance[:, None]
    assert np.abs(moved - SIX_DIRECTIONS).max() < 1e-5
    assert np.abs(answer.rotations).max() < 1e-6
    assert answer.worst == pytest.approx(across, rel=1e-5)


def test_without_slip_it_is_the_inverse_of_the_grasp_stiffness() -> None:
    """ξ = (G K Gᵀ)⁻¹ w, also off centre (Cutkosky & Kao 1989)."""
    ring, center = ring_on_sphere(0.04, 1.0), np.array([0.005, -0.002, 0.01])
    answer = gravity_displacement(ring, center, mass=0.2, torque_scale=0.04, squeeze=500.0, **_STIFF)
    matrix = grasp_matrix(ring, center, 1.0)
    springs = np.diag(np.tile([_TANGENTIAL, _TANGENTIAL, _NORMAL, 0.0], 3))
    loads = np.concatenate([SIX_DIRECTIONS * _WEIGHT, np.zeros((6, 3))], axis=1)
    exact = np.linalg.solve(matrix @ springs @ matrix.T, loads.T).T
    assert answer.displacements == pytest.approx(exact[:, :3], abs=1e-5 * np.abs(exact[:, :3]).max())
    assert answer.rotations == pytest.approx(exact[:, 3:], abs=1e-5 * np.abs(exact[:, 3:]).max())


def test_a_pushed_away_contact_lets_go() -> None:
    """Two frictionless fingers above and below, barely squeezed: one spring carries what two did."""
    contacts = Contacts([[0, 0, 0.03], [0, 0, -0.03]], [[0, 0, -1], [0, 0, 1]], 0.0)
    answer = gravity_displacement(
        contacts, (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=0.0, directions=[[0, 0, -1], [1, 0, 0]], **_STIFF
    )
    assert answer.held.tolist() == [True, False]
    assert answer.distance[0] == pytest.approx(_WEIGHT / _NORMAL, rel=1e-6)
    assert answer.forces[0, :, 2] == pytest.approx([0.0, _WEIGHT], rel=1e-6, abs=1e-9)
    assert np.isinf(answer.worst)


def test_a_sliding_pinch_wedges_itself_tighter() -> None:
    """Weight W across a pinch squeezed by N each, beyond 2 μ N. Sliding is associated: by symmetry each contact's
    trial force (k_t v, N) is projected on the cone's edge along K, f_n = (N + μ k_n v) / (1 + μ² k_n/k_t), and
    2 μ f_n = W gives v = (W (1 + μ² k_n/k_t)/(2μ) − N) / (μ k_n)."""
    friction, each = 0.3, 1.0
    pinch = two_on_sphere(0.03, friction, 0.004)
    answer = gravity_displacement(
        pinch, (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=2.0 * each, directions=[[0, 0, -1]], **_STIFF
    )
    ratio = friction**2 * _NORMAL / _TANGENTIAL
    assert 2.0 * friction * each < _WEIGHT
    exact = (_WEIGHT * (1.0 + ratio) / (2.0 * friction) - each) / (friction * _NORMAL)
    assert answer.distance[0] == pytest.approx(exact, rel=1e-5)
    assert answer.forces[0, :, 2] == pytest.approx(_WEIGHT / (2.0 * friction), rel=1e-5)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 100_000), friction=st.floats(0.2, 1.2), squeeze=st.floats(0.0, 20.0))
def test_forces_balance_and_stay_in_their_cones(seed: int, friction: float, squeeze: float) -> None:
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(5, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    contacts = Contacts(0.03 * directions, -directions, friction, 0.003)
    answer = gravity_displacement(contacts, (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=squeeze)
    for held, force, way in zip(answer.held, answer.forces, SIX_DIRECTIONS, strict=True):
        if not held:
            assert np.isnan(force).all()
            continue
        wrench = grasp_matrix(contacts, (0, 0, 0), 0.03) @ force.ravel()
        assert np.abs(wrench + _WEIGHT * np.r_[way, 0, 0, 0]).max() < 1e-5 * _WEIGHT
        sideways = np.sqrt((force[:, :2] ** 2).sum(axis=1) / friction**2 + (force[:, 3] / 0.003) ** 2)
        assert (sideways <= force[:, 2] * (1.0 + 1e-9) + 1e-9).all()
    # gravity works: the object never ends above where it began
    held = answer.held
    assert (np.einsum("di,di->d", answer.displacements[held], SIX_DIRECTIONS[held]) > 0.0).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 100_000), softer=st.floats(1.0, 4.0))
def test_softer_skin_gives_more(seed: int, softer: float) -> None:
    rng = np.random.default_rng(seed)
    contacts = ring_on_sphere(0.03, 0.8, 4, 0.2 * rng.random())
    some = {"mass": 0.2, "torque_scale": 0.03, "squeeze": 8.0}
    hard = gravity_displacement(contacts, (0, 0, 0), **some)  # type: ignore[arg-type]
    soft = gravity_displacement(
        contacts,
        (0, 0, 0),
        **some,  # type: ignore[arg-type]
        normal_stiffness=3500.0 / softer,
        tangential_stiffness=2400.0 / softer,
    )
    assert soft.worst == pytest.approx(softer * hard.worst, rel=1e-4)


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_weight_four_on_a_box_hold(friction: float) -> None:
    """A normal force of 1 N in all: μ upwards wherever it is spent; sideways one contact pushes with 1 N of which
    the two beside it can add nothing without taking from it while μ < 1."""
    box = four_on_box(0.03, friction)
    assert resisted_wrench(box, [0, 0, -1, 0, 0, 0], edges=4) == pytest.approx(friction, abs=1e-7)
    assert resisted_wrench(box, [1, 0, 0, 0, 0, 0], edges=4) == pytest.approx(1.0, abs=1e-7)
    assert resisted_wrench(box, [1, 0, 0, 0, 0, 0], edges=4, budget=5.0) == pytest.approx(5.0, abs=1e-6)


def test_bad_arguments_are_named() -> None:
    box = four_on_box(0.03, 0.5)
    good: dict[str, float] = {"mass": 0.2, "torque_scale": 0.03, "squeeze": 1.0}
    for name, value in (("mass", 0.0), ("squeeze", -1.0), ("normal_stiffness", np.nan), ("tangential_stiffness", 0.0)):
        with pytest.raises(InputError, match=name):
            gravity_displacement(box, (0, 0, 0), **(good | {name: value}))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="directions: want finite vectors"):
        gravity_displacement(box, (0, 0, 0), directions=[[0, 1, 0], [0, 0, 0]], **good)
    with pytest.raises(InputError, match="wrench"):
        resisted_wrench(box, [0.0] * 6)
    with pytest.raises(InputError, match="budget"):
        resisted_wrench(box, [1.0, 0, 0, 0, 0, 0], budget=0.0)


def test_lift_is_what_friction_holds_of_the_squeeze() -> None:
    """Two fingers on a line: along it one pushes with all there is, across it friction holds μ times that."""
    answer = gravity_displacement(
        two_on_sphere(0.03, 0.8), (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=5.0, **_STIFF
    )
    times = 5.0 / _WEIGHT
    assert answer.lift == pytest.approx([times] * 2 + [0.8 * times] * 4, rel=1e-6)


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.integers(0, 2**31 - 1), st.floats(0.5, 50.0))
def test_lift_is_the_resistance_with_that_budget(seed: int, squeeze: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4, 3))
    contacts = Contacts(0.03 * points, -points + 0.3 * rng.normal(size=(4, 3)), 0.6)
    answer = gravity_displacement(contacts, (0, 0, 0), mass=0.2, torque_scale=0.03, squeeze=squeeze, **_STIFF)
    for way, lift in zip(SIX_DIRECTIONS, answer.lift, strict=True):
        load = np.r_[way * _WEIGHT, np.zeros(3)]
        direct = resisted_wrench(contacts, load, torque_scale=0.03, budget=squeeze)
        assert lift == pytest.approx(direct, rel=1e-5, abs=1e-6)
