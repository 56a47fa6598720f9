"""Quaternion arithmetic against SciPy's, and its corner cases."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from warpjld.geometry.rotations import axis_turns, conjugate, matrices, minimal_rotation, multiply, rotate, slerp, unit

EXACT = 1e-12

seeds = st.integers(0, 2**31)


def turns(seed: int, count: int) -> np.ndarray:
    return Rotation.random(count, np.random.default_rng(seed)).as_quat()


@given(seeds)
def test_products_are_those_of_scipy(seed: int) -> None:
    a, b = turns(seed, 8).reshape(2, 4, 4)
    got = Rotation.from_quat(multiply(a, b)).as_matrix()
    np.testing.assert_allclose(got, (Rotation.from_quat(a) * Rotation.from_quat(b)).as_matrix(), atol=EXACT)
    np.testing.assert_allclose(multiply(a, conjugate(a)), np.tile([0, 0, 0, 1.0], (4, 1)), atol=EXACT)
    vectors = np.random.default_rng(seed).normal(size=(4, 3))
    np.testing.assert_allclose(rotate(a, vectors), Rotation.from_quat(a).apply(vectors), atol=EXACT)


@given(seeds)
def test_few_are_computed_as_many_are(seed: int) -> None:
    """Bit for bit: a pose is the same alone and in a batch."""
    a, b = turns(seed, 1200).reshape(2, 600, 4) * 1.3
    for product, other in ((multiply, b), (rotate, b[:, :3])):
        many = product(a, other)
        few = np.concatenate([product(a[k : k + 7], other[k : k + 7]) for k in range(0, 600, 7)])
        np.testing.assert_array_equal(few, many)
        np.testing.assert_array_equal(product(a[:3, None], other[None, :5])[2, 4], product(a[2], other[4]))


@given(seeds)
def test_minimal_rotation_turns_one_into_the_other_without_twist(seed: int) -> None:
    a, b = unit(np.random.default_rng(seed).normal(size=(2, 5, 3)))
    turn = minimal_rotation(a, b)
    np.testing.assert_allclose(rotate(turn, a), b, atol=1e-9)
    np.testing.assert_allclose((turn[:, :3] * (a + b)).sum(-1), 0, atol=1e-9)


def test_minimal_rotation_of_opposite_and_of_equal_directions() -> None:
    for axis in np.eye(3):
        np.testing.assert_allclose(rotate(minimal_rotation(axis, -axis), axis), -axis, atol=EXACT)
        np.testing.assert_allclose(minimal_rotation(axis, axis), [0, 0, 0, 1], atol=EXACT)


@given(seeds)
def test_slerp_is_that_of_scipy(seed: int) -> None:
    keys = turns(seed, 4)
    times, at = np.array([0.0, 1.0, 3.0, 3.5]), np.linspace(0, 3.5, 23)
    got = Rotation.from_quat(slerp(times, keys, at)).as_matrix()
    np.testing.assert_allclose(got, Slerp(times, Rotation.from_quat(keys))(at).as_matrix(), atol=1e-9)


def test_slerp_holds_outside_and_takes_one_key() -> None:
    keys = turns(3, 6).reshape(2, 3, 4)
    got = slerp(np.array([1.0, 2.0]), keys, np.array([-1.0, 5.0]))
    np.testing.assert_allclose(np.abs((got * keys).sum(-1)), 1, atol=EXACT)
    assert slerp(np.array([1.0]), keys[:1], np.zeros(4)).shape == (4, 3, 4)


@given(seeds, st.sampled_from([1.0, 3.0]))
def test_matrices_are_those_of_scipy(seed: int, length: float) -> None:
    a = turns(seed, 6)
    np.testing.assert_allclose(matrices(length * a), Rotation.from_quat(a).as_matrix(), atol=EXACT)
    np.testing.assert_allclose(matrices(length * a[0]), Rotation.from_quat(a[0]).as_matrix(), atol=EXACT)


def test_axis_turns_are_the_octahedral_group() -> None:
    ours, theirs = axis_turns(), Rotation.create_group("O").as_quat()
    assert ours.shape == (24, 4)
    np.testing.assert_allclose(np.sort(np.abs(ours @ theirs.T), axis=1)[:, -1], 1.0, atol=EXACT)
    np.testing.assert_allclose(np.abs(ours @ ours.T) > 1.0 - EXACT, np.eye(24, dtype=bool))
