"""Bonds that hold up to a strength and then part for good; bodies made of bonded sub-objects (R101, R102)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.fem import Body, LinearElastic, Loads, Prescribed, SolveStatus, box_hexes, prescribe
from warpjld.fem.contact import Bond, ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane

YOUNG = 1e6
HALF = 0.05
LAW = LinearElastic(YOUNG, 0.0)
NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))


def stack() -> Body:
    """Two half cubes that do not match, 0.1 m high together."""
    lower, upper = box_hexes((0.1, 0.1, HALF), (3, 3, 2)), box_hexes((0.1, 0.1, HALF), (4, 4, 2))
    return together({"a": (named(lower, "a"), LAW), "b": (named(upper, "b", (0, 0, HALF)), LAW)})


def pulled(body: Body, way: tuple[float, float, float]) -> Prescribed:
    return prescribe(body.mesh, "a.z-", x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, "b.z+", displacement=way)


def stress(found: ContactSolution) -> np.ndarray:
    """Mean traction that the bond passes on, at each instant [Pa], shape (T, 3)."""
    return np.array([instant.touches[0].force / 0.01 for instant in found.instants])


def test_parts_at_its_strength() -> None:
    """Poisson's ratio 0: a uniform tension, E times strain, so that everything parts in the same step."""
    body = stack()
    strength = 2e4
    times = np.arange(1, 11) / 10
    found = press(
        body, pulled(body, (0.0, 0.0, 0.004)), [Pair("a.z+", "b.z-", bond=Bond(normal=strength))], times=times
    )
    tension = stress(found)[:, 2]
    expected = YOUNG * 0.04 * times
    holds = expected < strength
    np.testing.assert_allclose(tension[holds], expected[holds], rtol=1e-4)
    assert np.abs(tension[~holds]).max() < 1e-6 * strength
    assert all(i.touches[0].bonded.all() for i, held in zip(found.instants, holds, strict=True) if held)
    assert not found.last.touches[0].bonded.any()
    half = found.last.displacement[body.mesh.node_set("b.z-"), 2]
    np.testing.assert_allclose(half, 0.004, rtol=1e-4)  # what parted hangs without strain


def test_what_has_parted_stays_parted() -> None:
    """Pulled apart, brought together (it presses), pulled again: no tension any more."""
    body = stack()
    travel = [0.002, 0.004, 0.0, -0.001, 0.001]
    moves = lambda t: pulled(body, (0.0, 0.0, float(np.interp(t, np.arange(6), [0.0, *travel]))))  # noqa: E731
    pair = Pair("a.z+", "b.z-", bond=Bond(normal=3e4))
    tension = stress(press(body, moves, [pair], times=(1, 2, 3, 4, 5)))[:, 2]
    np.testing.assert_allclose(tension, [2e4, 0.0, 0.0, -1e4, 0.0], atol=20.0)


def test_parts_under_shear() -> None:
    body = stack()
    found = press(
        body, pulled(body, (0.002, 0.0, 0.0)), [Pair("a.z+", "b.z-", bond=Bond(shear=7e3))], times=np.arange(1, 5) / 4
    )
    shear = stress(found)[:, 0]
    assert shear[0] > 1e3
    assert np.abs(shear[-1]) < 1e-3 * shear[0]
    assert not found.last.touches[0].bonded.any()


def test_a_bond_that_is_strong_enough_is_one_body() -> None:
    """Matching meshes: the bonded halves move as the whole block does."""
    from warpjld.fem import solve

    law = LinearElastic(YOUNG, 0.3)
    halves = [named(box_hexes((0.1, 0.1, HALF), (4, 4, 2)), name, (0, 0, z)) for name, z in (("a", 0.0), ("b", HALF))]
    body = together({"a": (halves[0], law), "b": (halves[1], law)})
    whole = Body(box_hexes((0.1, 0.1, 2 * HALF), (4, 4, 4)), law)
    way = (0.001, 0.0005, 0.002)
    bonded = press(body, pulled(body, way), [Pair("a.z+", "b.z-", bond=Bond())], tolerance=1e-8, penetration=1e-6)
    held = prescribe(whole.mesh, "z-", x=0.0, y=0.0, z=0.0) + prescribe(whole.mesh, "z+", displacement=way)
    expected = solve(whole, held).displacement
    places = {tuple(np.round(x, 6)): u for x, u in zip(whole.mesh.nodes, expected, strict=True)}
    wanted = np.array([places[tuple(np.round(x, 6))] for x in body.mesh.nodes])
    np.testing.assert_allclose(bonded.last.displacement, wanted, atol=1e-4 * np.abs(wanted).max())


def test_a_cube_of_sub_objects_separates() -> None:
    """Eight bonded cubes, pulled at opposite faces: the bonds across the pull part, those along it do not (R102)."""
    names = {(i, j, k): f"{i}{j}{k}" for i in (0, 1) for j in (0, 1) for k in (0, 1)}
    parts = {
        name: (named(box_hexes((0.05, 0.05, 0.05), (2, 2, 2)), name, 0.05 * np.array(at)), LAW)
        for at, name in names.items()
    }
    body = together(parts)
    pairs, across = [], []
    for at, name in names.items():
        for axis, letter in enumerate("xyz"):
            if at[axis] == 0:
                other = names[tuple(v + (k == axis) for k, v in enumerate(at))]  # type: ignore[index]
                pairs.append(Pair(f"{name}.{letter}+", f"{other}.{letter}-", bond=Bond(normal=1e4, shear=1e4)))
                across.append(axis == 2)
    bottom = np.flatnonzero(body.mesh.nodes[:, 2] == 0.0)
    top = np.flatnonzero(np.isclose(body.mesh.nodes[:, 2], 0.1))
    held = prescribe(body.mesh, bottom, x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, top, x=0.0, y=0.0, z=0.004)
    found = press(body, held, pairs, times=(0.2, 0.5, 1.0))
    assert all(touch.bonded.all() for touch in found.instants[0].touches)
    for touch, parted in zip(found.last.touches, across, strict=True):
        assert touch.bonded.any() != parted
    assert np.abs(found.last.reactions).max() < 1e-4 * np.abs(found.instants[0].reactions).max()


def test_a_bond_to_nothing_is_refused() -> None:
    from warpjld.errors import InputError

    lower, upper = box_hexes((0.1, 0.1, HALF), (2, 2, 1)), box_hexes((0.1, 0.1, HALF), (2, 2, 1))
    body = together({"a": (named(lower, "a"), LAW), "b": (named(upper, "b", (0, 0, 1.0)), LAW)})
    with pytest.raises(InputError, match="a bond to nothing"):
        press(body, pulled(body, (0.0, 0.0, 0.0)), [Pair("a.z+", "b.z-", bond=Bond())])


def test_bonded_bodies_that_nothing_holds_are_named_together() -> None:
    """Each is held by the other, and both by nothing: not a matter of the stiffness."""
    body = stack()
    bond = Pair("a.z+", "b.z-", bond=Bond(normal=2e4))
    found = press(body, NOTHING, [bond], Loads(gravity=(0.0, 0.0, -9.81)), times=(1.0,), check=False)
    assert found.status is SolveStatus.UNHELD
    assert "nothing holds 'a' and 'b'" in found.message


def test_bonded_bodies_stand_on_what_holds_one_of_them() -> None:
    body = stack()
    bond, floor = Pair("a.z+", "b.z-", bond=Bond(normal=2e4)), Pair("a.z-", Plane((0, 0, 0), (0, 0, 1)), 0.5)
    found = press(body, NOTHING, [bond, floor], Loads(gravity=(0.0, 0.0, -9.81)), times=(1.0,))
    assert found.converged
    weight = 9.81 * 1e-3 * LAW.density
    assert found.last.touches[1].force[2] == pytest.approx(weight, rel=1e-3)
