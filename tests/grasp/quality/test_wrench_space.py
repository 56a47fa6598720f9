"""Epsilon and volume against values derived by hand, and what must not change them.

Derivations use the support function h(u) = max over primitive wrenches w of u·w: epsilon is its minimum over unit u,
which is the definition of the largest ball inside, without any hull.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tests.grasp.quality.sets import four_on_box, least_on_sphere, ring_on_sphere, two_on_sphere
from warpjld.errors import InputError
from warpjld.grasp.quality import Contacts, contact_wrenches, least_resistance, wrench_space
from warpjld.grasp.quality.nearest_facet import distances_to_boundary, hull_measures
from warpjld.grasp.quality.wrench_space import least_resistances

_ROUNDING = 1e-9  # qhull works in float64 on numbers around 1
_FRICTIONS = (0.2, 0.5, 0.9)


@pytest.mark.parametrize("friction", _FRICTIONS)
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_two_soft_fingers_on_a_sphere(friction: float, scale: float) -> None:
    """Antipodal at ±R x̂ with round cones, k = R/ρ, g = γ/ρ, u = (a, B; p, S): the contacts' supports are
    −a + max(μ|B + kS⊥|, g|p|) and a + max(μ|B − kS⊥|, g|p|). Their larger one is at least the mean, reached by the
    choice of a. For a given mean V the longest u has either one tangential part zero and p = 0, of squared length
    V²(1 + (1 + 1/k²)/μ²), or both parts V/μ and p = V/g, of V²(max(1, 1/k²)/μ² + 1/g²) (convex in between). Hence

        epsilon = min( (1 + (1 + 1/k²)/μ²)^-½ ,  (max(1, 1/k²)/μ² + 1/g²)^-½ ).
    """
    radius, spin = 0.03, 0.01
    k, g = scale, spin / (radius / scale)
    exact = min(
        (1.0 + (1.0 + k**-2) / friction**2) ** -0.5,
        (max(1.0, k**-2) / friction**2 + g**-2) ** -0.5,
    )
    errors = []
    for edges in (12, 24, 48):
        space = wrench_space(two_on_sphere(radius, friction, spin), (0, 0, 0), torque_scale=radius / scale, edges=edges)
        errors.append(exact - space.epsilon)
    # pyramids inscribed in the cones judge from below, and converge as edges⁻²
    assert min(errors) > -_ROUNDING
    assert errors[2] < 0.004 * exact
    if errors[2] > 1e-6:
        assert np.log2(errors[0] / errors[2]) / 2.0 > 1.8


@pytest.mark.parametrize("friction", _FRICTIONS)
def test_four_on_a_box(friction: float) -> None:
    """Sides of a square box at distance a = ρ, four edges along the axes. u is resisted by at most 1 where
    ∓F_x + μ max(|F_y ± M_z|, |F_z ∓ M_y|) ≤ 1 and ∓F_y + μ max(|F_x ∓ M_z|, |F_z ± M_x|) ≤ 1. The longest such u has
    F_x = F_y = F_z = 0 and M_x, M_y, M_z = ±1/μ, of length √3/μ, while μ < 2. So epsilon = μ/√3.
    """
    space = wrench_space(four_on_box(0.04, friction), (0, 0, 0), torque_scale=0.04, edges=4)
    assert space.epsilon == pytest.approx(friction / np.sqrt(3.0), abs=_ROUNDING)


@pytest.mark.parametrize("scale", [0.6, 1.0])
def test_three_rough_fingers_on_a_sphere(scale: float) -> None:
    """Contacts at R e_i on the equator, 120° apart, round cones, k = R/ρ. The support of contact i is
    −F·e_i + μ √((F·t_i + k M_z)² + (F_z − k M·t_i)²), t_i = ẑ × e_i. Along F = −f e_3, M = m e_3 contact 3 supports f
    alone and the two others −f/2 + μ √3/2 √(f² + k² m²) each. All are equal, with f² + m² = 1, at

        epsilon = f = μ k / √(3 − μ² + μ² k²):

    rough contacts on a small ball are weakest against a finger's own push combined with a turn about it."""
    friction, edges = 0.9, 36
    exact = friction * scale / np.sqrt(3.0 - friction**2 + (friction * scale) ** 2)
    space = wrench_space(ring_on_sphere(0.05, friction), (0, 0, 0), torque_scale=0.05 / scale, edges=edges)
    # from below; the faces of the inscribed pyramid have 0.4 % less slope than the cone
    assert 0.995 * exact <= space.epsilon <= exact + _ROUNDING


@pytest.mark.parametrize("friction", [0.2, 0.5])
@pytest.mark.parametrize("scale", [0.6, 1.7])
def test_three_fingers_on_a_sphere_against_the_round_cones_support(friction: float, scale: float) -> None:
    """The same support, whose least value over the unit sphere is searched for without any hull."""
    angles = 2.0 * np.pi * np.arange(3) / 3
    e = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    t = np.cross([0.0, 0, 1], e)

    def support(u: np.ndarray) -> np.ndarray:
        u = u / np.linalg.norm(u, axis=-1, keepdims=True)
        force, moment = u[..., :3], u[..., 3:]
        sideways = force @ t.T + scale * moment[..., 2:]
        upwards = force[..., 2:] - scale * (moment @ t.T)
        return (-force @ e.T + friction * np.hypot(sideways, upwards)).max(axis=-1)

    exact = least_on_sphere(support)
    edges = 30
    space = wrench_space(ring_on_sphere(0.05, friction), (0, 0, 0), torque_scale=0.05 / scale, edges=edges)
    # from below; the faces of the inscribed pyramid have 0.55 % less slope than the cone
    assert 0.99 * exact <= space.epsilon <= exact * (1.0 + 1e-4)


def test_volume_of_a_cross_polytope() -> None:
    """Three opposed pairs of soft contacts without tangential friction exert (∓e_i, ±γ e_i). With γ = ρ these twelve
    are the corners of three squares of area 4 in orthogonal planes. Their hull is the squares' free sum, of volume
    4·4·4 · 2!2!2!/6!, and its inner radius that of three mutually orthogonal facets at distance 1: 1/√3."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    contacts = Contacts(points, -points, 0.0, 1.0)
    space = wrench_space(contacts, (0, 0, 0), torque_scale=1.0)
    assert space.volume == pytest.approx(64.0 * 8.0 / 720.0, rel=1e-9)
    assert space.epsilon == pytest.approx(1.0 / np.sqrt(3.0), abs=_ROUNDING)


def test_linf_of_opposed_pairs() -> None:
    """The same contacts, each with up to 1 N. For u with force part a and torque part p along a pair's axis the pair
    supports max(0, |p| − a) + max(0, |p| + a) ≥ |a| + |p|, with equality where |a| ≥ |p|. So h(u) ≥ ‖u‖₁ ≥ ‖u‖₂ = 1,
    with equality at a pure force along an axis."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    contacts = Contacts(points, -points, 0.0, 1.0)
    space = wrench_space(contacts, (0, 0, 0), torque_scale=1.0, norm="Linf")
    assert space.epsilon == pytest.approx(1.0, abs=_ROUNDING)
    assert abs(space.weakest[:3]).max() == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("norm", ["L1", "Linf"])
def test_epsilon_is_the_least_support(norm: str) -> None:
    """The definition itself on an irregular grasp: no sampled direction has less support, the weakest has just that."""
    contacts = _irregular()
    space = wrench_space(contacts, (0, 0, 0), torque_scale=0.04, norm=norm, edges=4)  # type: ignore[arg-type]
    blocks = contact_wrenches(contacts, (0, 0, 0), 0.04, 4)
    directions = np.random.default_rng(3).normal(size=(20_000, 6))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    each = np.stack([np.maximum(directions @ block, 0.0).max(axis=1) for block in blocks])
    weak = np.array([np.maximum(space.weakest @ block, 0.0).max() for block in blocks])
    total, least = (each.max(axis=0), weak.max()) if norm == "L1" else (each.sum(axis=0), weak.sum())
    assert space.epsilon > 0.01
    assert total.min() >= space.epsilon - _ROUNDING
    assert least == pytest.approx(space.epsilon, abs=_ROUNDING)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.floats(0.1, 10.0))
def test_rotation_scale_and_translation_change_nothing(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    contacts, center = _irregular(), rng.normal(size=3) * 0.01
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = contacts.moved(turn, shift)
    grown = Contacts(size * moved.points, moved.normals, moved.friction, moved.spin, moved.tangents)
    one = wrench_space(contacts, center, torque_scale=0.05, edges=4)
    other = wrench_space(grown, size * (turn @ center + shift), torque_scale=size * 0.05, edges=4)
    assert other.epsilon == pytest.approx(one.epsilon, rel=1e-6, abs=_ROUNDING)
    assert other.volume == pytest.approx(one.volume, rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(less=st.floats(0.05, 1.0), more=st.floats(0.0, 0.5))
def test_more_friction_is_never_worse(less: float, more: float) -> None:
    rough = _irregular(less + more)
    smooth = _irregular(less)
    a = wrench_space(smooth, (0, 0, 0), torque_scale=0.05, edges=5)
    b = wrench_space(rough, (0, 0, 0), torque_scale=0.05, edges=5)
    # the inscribed pyramid of a wider cone contains that of a narrower one
    assert b.epsilon >= a.epsilon - _ROUNDING
    assert b.volume >= a.volume * (1.0 - 1e-9)


def test_no_contacts_and_flat_wrenches_measure_zero() -> None:
    empty = Contacts(np.zeros((0, 3)), np.zeros((0, 3)), 0.5)
    for contacts in (empty, two_on_sphere(0.03, 0.5), two_on_sphere(0.03, 0.0)):
        space = wrench_space(contacts, (0, 0, 0), torque_scale=0.03)
        assert (space.epsilon, space.volume) == (0.0, 0.0)


def test_bad_arguments_are_named() -> None:
    good = four_on_box(0.04, 0.5)
    with pytest.raises(InputError, match="norm"):
        wrench_space(good, (0, 0, 0), torque_scale=1.0, norm="L2")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="torque_scale"):
        wrench_space(good, (0, 0, 0), torque_scale=0.0)
    with pytest.raises(InputError, match="center"):
        wrench_space(good, (0, 0, np.nan), torque_scale=1.0)
    with pytest.raises(InputError, match="edges"):
        wrench_space(good, (0, 0, 0), torque_scale=1.0, edges=2)
    with pytest.raises(InputError, match="fewer edges"):
        wrench_space(ring_on_sphere(1.0, 0.5, 12), (0, 0, 0), torque_scale=1.0, norm="Linf")


def _irregular(friction: float = 0.6) -> Contacts:
    """Four contacts on an ellipsoid."""
    directions = np.array([[1.0, 0.2, 0.1], [-0.8, 0.5, -0.2], [-0.3, -0.9, 0.3], [0.1, 0.2, -1.0]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    axes = np.array([0.03, 0.04, 0.05])
    return Contacts(directions * axes, -directions / axes, friction)


@pytest.mark.parametrize("count", [2, 3, 5, 9])
@pytest.mark.parametrize("spin", [0.0, 0.002])
def test_a_growing_hull_ends_with_the_same_epsilon(count: int, spin: float) -> None:
    rng = np.random.default_rng(count)
    for _ in range(8):
        points = rng.normal(size=(count, 3))
        points *= 0.03 / np.linalg.norm(points, axis=1, keepdims=True)
        normals = -points / 0.03 + 0.3 * rng.normal(size=(count, 3))
        contacts = Contacts(points, normals, np.array(0.6), np.array(spin))
        whole = wrench_space(contacts, (0, 0, 0), torque_scale=0.03).epsilon
        assert least_resistance(contacts, (0, 0, 0), torque_scale=0.03) == pytest.approx(whole, abs=1e-9)


def by_qhull(contacts: Contacts, torque_scale: float) -> tuple[float, float]:
    """Volume and epsilon of the hull of the origin and all primitive wrenches."""
    wrenches = np.concatenate(contact_wrenches(contacts, (0, 0, 0), torque_scale), axis=1).T
    hull = ConvexHull(np.concatenate([np.zeros((1, 6)), wrenches]))
    return hull.volume, max(0.0, -hull.equations[:, -1].max())


def test_a_growing_hull_of_regular_grasps() -> None:
    """Facets of more than six wrenches, which qhull merges."""
    for contacts in (four_on_box(0.04, 0.5), two_on_sphere(0.05, 0.5, 0.01), ring_on_sphere(0.05, 0.7)):
        volume, epsilon = by_qhull(contacts, 0.05)
        assert least_resistance(contacts, (0, 0, 0), torque_scale=0.05) == pytest.approx(epsilon, abs=1e-9)
        whole = wrench_space(contacts, (0, 0, 0), torque_scale=0.05)
        assert (whole.volume, whole.epsilon) == pytest.approx((volume, epsilon), rel=1e-8)
    assert (
        least_resistance(Contacts(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)), (0, 0, 0), torque_scale=1.0) == 0.0
    )


def test_the_growing_hull_finds_the_nearest_facet_of_the_whole_hull() -> None:
    """Sets like those of hands, with cones of coplanar edges, and with and without force closure."""
    rng = np.random.default_rng(4)
    grasps = []
    for count in rng.integers(2, 9, size=40):
        normals = rng.normal(size=(count, 3)) + rng.uniform(0.0, 1.2) * np.array([0.0, 0.0, 1.0])
        points = 0.03 * rng.normal(size=(count, 3))
        grasps.append(Contacts(points, normals, rng.uniform(0.2, 1.0), rng.uniform(0.0, 0.004)))
    grasps += [two_on_sphere(0.03, 0.5, 0.01), ring_on_sphere(0.03, 0.4, 4), four_on_box(0.04, 0.6)]
    found = least_resistances(grasps, (0.0, 0.0, 0.0), torque_scale=0.05)
    whole = np.array([by_qhull(one, 0.05) for one in grasps])
    np.testing.assert_allclose(found, whole[:, 1], rtol=0.0, atol=_ROUNDING)
    spaces = [wrench_space(one, (0.0, 0.0, 0.0), torque_scale=0.05) for one in grasps]
    np.testing.assert_allclose([one.epsilon for one in spaces], whole[:, 1], rtol=0.0, atol=_ROUNDING)
    # by the volume between the unperturbed points, though the facets are those of perturbed ones
    np.testing.assert_allclose([one.volume for one in spaces], whole[:, 0], rtol=1e-8)
    for one, space in zip(grasps, spaces, strict=True):
        if space.epsilon:
            heights = space.weakest @ np.concatenate(contact_wrenches(one, (0, 0, 0), 0.05), axis=1)
            assert heights.max() == pytest.approx(space.epsilon, abs=_ROUNDING)
    assert 10 < np.count_nonzero(found) < len(grasps)


def test_points_on_one_facet_are_no_reason_for_doubt() -> None:
    """A cube's facets hold half of its corners each; the kernel decides alone, and of a shifted cube, too."""
    corners = np.array(list(product((-1.0, 1.0), repeat=6)))
    shifted = corners + np.array([0.4, 0.0, 0.0, -0.2, 0.0, 0.0])
    outside = corners + np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # the origin on a facet
    distances = distances_to_boundary([np.concatenate([np.zeros((1, 6)), p]) for p in (corners, shifted, outside)])
    assert distances == pytest.approx([1.0, 0.6, 0.0], abs=1e-12)


def test_the_whole_hull_of_a_cube() -> None:
    """Of its 720 corner simplices or more none is in the perturbed hull for certain, but their volume is the cube's."""
    corners = np.array(list(product((-1.0, 1.0), repeat=6))) + np.array([0.4, 0.0, 0.0, -0.2, 0.0, 0.0])
    measured = hull_measures(np.concatenate([np.zeros((1, 6)), corners]))
    assert measured is not None
    assert measured[:2] == pytest.approx((64.0, 0.6), rel=1e-12)
    assert measured[2] == pytest.approx([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-12)
