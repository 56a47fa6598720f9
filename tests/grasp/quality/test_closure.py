"""Force closure against what theory says of textbook sets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.grasp.quality.sets import four_on_box, ring_on_sphere
from warpjld.errors import InputError
from warpjld.grasp.quality import Contacts, force_closure, grasp_matrix, patch_spin, wrench_space
from warpjld.grasp.quality.closure import closure_margins

_UNIT = st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(numbers=st.lists(_UNIT, min_size=12, max_size=12))
def test_two_frictionless_contacts_never_close(numbers: list[float]) -> None:
    """Two wrenches cannot positively span six dimensions; seven are needed (Murray, Li & Sastry 1994, §5.3)."""
    points, normals = np.array(numbers).reshape(2, 2, 3)
    normals = normals + np.array([0.0, 0.0, 3.0]) * np.array([[1.0], [-1.0]])
    closure = force_closure(Contacts(points, normals, 0.0))
    assert not closure.closed
    assert closure.margin == 0.0


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 100_000), friction=st.floats(0.1, 2.0))
def test_two_hard_fingers_cannot_hold_a_turn_about_their_line(seed: int, friction: float) -> None:
    """No point contact has a torque about the line through both: rank 5 at most."""
    rng = np.random.default_rng(seed)
    closure = force_closure(Contacts(rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), friction))
    assert not closure.closed
    assert not closure.full_rank


@pytest.mark.parametrize("angle", [0.0, 10.0, 25.0, 40.0])
def test_two_soft_fingers_close_if_their_line_lies_in_both_cones(angle: float) -> None:
    """Nguyen 1988, Theorem 5. On a sphere, both contacts moved by δ from an antipodal pair towards each other, their
    line makes δ with both normals: closed if and only if μ > tan δ. An edge of the cones points along the line."""
    delta = np.radians(angle)
    directions = np.array([[np.cos(delta), 0.0, np.sin(delta)], [-np.cos(delta), 0.0, np.sin(delta)]])
    tangents = np.tile([0.0, 0.0, 1.0], (2, 1))
    for factor, expected in ((0.98, False), (1.02, True)):
        friction = factor * np.tan(delta)
        if friction == 0.0:
            continue
        contacts = Contacts(0.03 * directions, -directions, friction, 0.005, tangents)
        assert force_closure(contacts, torque_scale=0.03).closed is expected


@pytest.mark.parametrize("latitude", [5.0, 20.0, 35.0])
@pytest.mark.parametrize("count", [3, 4, 7])
def test_fingers_above_the_equator_hold_if_friction_beats_the_slope(latitude: float, count: int) -> None:
    """On a circle of latitude φ all normals push down by sin φ; only forces inclined by φ or more against them can
    balance: closed if and only if μ > tan φ."""
    slope = np.tan(np.radians(latitude))
    for factor, expected in ((0.98, False), (1.02, True)):
        contacts = ring_on_sphere(0.04, factor * slope, count, np.radians(latitude))
        assert force_closure(contacts, torque_scale=0.04).closed is expected


@pytest.mark.parametrize("count", [3, 8, 40])
def test_frictionless_fingers_never_hold_a_sphere(count: int) -> None:
    """Their normals meet in its centre: no torque."""
    directions = np.random.default_rng(count).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert not force_closure(Contacts(directions, -directions, 0.0)).closed


def test_four_on_a_box_close_with_any_friction_and_not_without() -> None:
    for friction in (0.01, 0.3, 1.0):
        closure = force_closure(four_on_box(0.03, friction), torque_scale=0.03, edges=4)
        assert closure.closed
        # by symmetry all sixteen edges can push alike
        assert closure.margin == pytest.approx(1.0, abs=1e-6)
        assert closure.squeeze == pytest.approx(0.25, abs=1e-6)
    assert not force_closure(four_on_box(0.03, 0.0)).closed


def test_seven_frictionless_contacts_can_close_and_six_cannot() -> None:
    """Positively spanning six dimensions takes seven wrenches (Markenscoff, Ni & Papadimitriou 1990)."""
    points = [[0.3, 0, 1], [-0.2, 0.4, 1], [-0.3, -0.5, 1], [0.1, -1, 0.3], [-0.5, -1, -0.2], [-1, 0.3, 0.1]]
    normals = [[0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
    wrenches = np.concatenate([np.array(normals, float), np.cross(points, np.array(normals, float))], axis=1)
    force, torque = -wrenches.sum(axis=0)[:3], -wrenches.sum(axis=0)[3:]
    # the seventh pushes along the line of action of what balances the six, as far as a pure force can
    points.append((np.cross(force, torque) / (force @ force)).tolist())
    normals.append(force.tolist())
    assert force_closure(Contacts(points, normals, 0.0)).closed
    for left_out in range(7):
        kept = [i for i in range(7) if i != left_out]
        assert not force_closure(Contacts(np.array(points)[kept], np.array(normals, float)[kept], 0.0)).closed


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 100_000), size=st.floats(0.2, 5.0))
def test_pose_size_and_reference_point_do_not_matter(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    contacts = _random(rng, 4, 0.4)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = contacts.moved(turn, shift)
    grown = Contacts(size * moved.points, moved.normals, 0.4, 0.0, moved.tangents)
    one = force_closure(contacts)
    other = force_closure(grown, center=size * shift + 0.1 * rng.normal(size=3), torque_scale=size)
    if one.margin > 1e-4 or other.margin > 1e-4 or one.margin == other.margin:
        assert one.closed == other.closed


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 100_000), less=st.floats(0.05, 0.8), more=st.floats(0.0, 0.5))
def test_friction_never_opens_a_grasp_and_epsilon_agrees(seed: int, less: float, more: float) -> None:
    one = force_closure(_random(np.random.default_rng(seed), 4, less))
    other = force_closure(_random(np.random.default_rng(seed), 4, less + more))
    assert other.closed or one.margin < 1e-5
    space = wrench_space(_random(np.random.default_rng(seed), 4, less), (0, 0, 0), torque_scale=1.0)
    if one.margin > 1e-4:
        assert space.epsilon > 0.0
    if space.epsilon > 1e-4:
        assert one.closed


def test_the_squeeze_found_is_an_internal_force_within_the_cones() -> None:
    contacts = _random(np.random.default_rng(8), 5, 0.8)
    closure = force_closure(contacts)
    assert closure.closed
    assert np.abs(grasp_matrix(contacts, (0, 0, 0), 1.0) @ closure.forces.ravel()).max() < 1e-7
    assert (np.hypot(*closure.forces[:, :2].T) <= 0.8 * closure.forces[:, 2] + 1e-9).all()
    assert closure.squeeze.sum() == pytest.approx(1.0, abs=1e-7)


def test_spin_of_a_patch_is_the_slipping_discs() -> None:
    """∫ μ p r dA over a disc of radius a under even pressure p, by midpoint quadrature."""
    friction, radius = 0.7, 0.004
    rings = (np.arange(2000) + 0.5) * radius / 2000
    torque = (friction * rings * 2.0 * np.pi * rings * radius / 2000).sum() / (np.pi * radius**2)
    assert patch_spin(friction, np.pi * radius**2) == pytest.approx(torque, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": [[0, 0]]}, "points"),
        ({"points": [[0, 0, np.nan]]}, "points.*contact 0.*not finite"),
        ({"normals": [[0, 0, 0]]}, "normals.*no direction"),
        ({"friction": -0.1}, "friction"),
        ({"friction": np.nan}, "friction"),
        ({"friction": [0.1, 0.2]}, "friction"),
        ({"digits": ("index", "thumb")}, "digits"),
    ],
)
def test_bad_contacts_are_named(change: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"points": [[0, 0, 0]], "normals": [[0, 0, 1]], "friction": 0.5}
    with pytest.raises(InputError, match=message):
        Contacts(**(good | change))  # type: ignore[arg-type]


def _random(rng: np.random.Generator, count: int, friction: float) -> Contacts:
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Contacts(directions, -directions, friction)


def test_margins_of_many_grasps_are_those_of_highs() -> None:
    rng = np.random.default_rng(6)
    grasps = [Contacts(np.zeros((0, 3)), np.zeros((0, 3)), 0.5), four_on_box(0.04, 0.6), ring_on_sphere(0.03, 0.0, 6)]
    for count in rng.integers(2, 9, size=40):
        normals = rng.normal(size=(count, 3)) + rng.uniform(0.0, 1.0) * np.array([0.0, 0.0, 1.0])
        grasps.append(Contacts(0.03 * rng.normal(size=(count, 3)), normals, rng.uniform(0.2, 1.0), 0.003))
    found = closure_margins(grasps, torque_scale=0.05, edges=6)
    alone = [force_closure(one, torque_scale=0.05, edges=6).margin for one in grasps]
    np.testing.assert_allclose(found, alone, rtol=0.0, atol=1e-9)
    assert 10 < np.count_nonzero(found) < len(grasps)
