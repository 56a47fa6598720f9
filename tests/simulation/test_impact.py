"""Bonded objects fall as one, and part where an impact is stronger than their bond (R93, R102)."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.grasp import Places, shapes
from warpjld.simulation.fall.bonded import bonded_groups
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.rigid_cluster import RigidCluster
from warpjld.simulation.fall.strike import found_strikes, impedance
from warpjld.simulation.fall.time_stepping import step_bodies
from warpjld.simulation.recorded import RecordedAnimation, RecordedObject
from warpjld.simulation.solve.falling import Falls, falling_names, follow_falls
from warpjld.simulation.specification import BondStrength, ContactSpecification, ObjectMaterial, SolveSpecification

G = np.array([0.0, -9.81, 0.0])
RUBBER = ObjectMaterial(young=1e6, poisson=0.3, density=1000.0, element=0.02)
HALVES = (("a", -0.03), ("b", 0.03))
EDGE = 0.04  # height of the edge on which the bar falls [m]


def dropped(height: float, strength: float, last: int) -> Falls:
    """Falls of a bar in two pieces, bonded above an edge, from a height [m] over it."""
    things = [
        RecordedObject(n, shapes.box(0.06, 0.02, 0.02), positions=(x, EDGE + 0.01 + height, 0.0)) for n, x in HALVES
    ]
    things.append(RecordedObject("edge", shapes.box(0.01, EDGE, 0.1), positions=(0.0, 0.5 * EDGE, 0.0)))
    things.append(RecordedObject("floor", shapes.box(0.4, 0.02, 0.3), positions=(0.0, -0.01, 0.0)))
    contact = ContactSpecification(
        physical={"a": RUBBER, "b": RUBBER},
        bonds=[BondStrength("a", "b", strength, strength)],
        everywhere=0.0,
        gravity=tuple(G),
    )
    request = SolveSpecification(0, last)
    names = falling_names(contact, request)
    assert names == ["a", "b"]
    return follow_falls(RecordedAnimation(objects=things), contact, request, names)


def halves() -> RigidCluster:
    piece = shapes.box(0.06, 0.02, 0.02)
    return RigidCluster([(rigid_shape(n, piece, RUBBER), Places.of((x, 0.2, 0.0))) for n, x in HALVES])


def test_a_cluster_is_as_rigid_as_the_whole() -> None:
    whole = RigidBody(rigid_shape("bar", shapes.box(0.12, 0.02, 0.02), RUBBER), Places.of((0.0, 0.2, 0.0)))
    both = halves()
    assert both.shape.mass == pytest.approx(whole.shape.mass)
    np.testing.assert_allclose(both.centre, whole.centre, atol=1e-12)
    np.testing.assert_allclose(both.shape.inertia, whole.shape.inertia, rtol=1e-9, atol=1e-15)
    for one in (whole, both):
        one.velocity, one.spin = np.array([0.3, 0.0, 0.0]), np.array([0.0, 2.0, 5.0])
        for k in range(12):
            step_bodies([one], {}, G, lambda a, b: 0.5, time=float(k), step=1.0, length=1.0 / 240.0)
    np.testing.assert_allclose(both.centre, whole.centre, atol=1e-12)
    np.testing.assert_allclose(both.turn, whole.turn, atol=1e-9)
    one, other = both.parts
    np.testing.assert_allclose(0.5 * (one.centre + other.centre), both.centre, atol=1e-12)
    away = np.array([[0.0, 0.05, 0.0], [0.01, 0.2, 0.03]]) + both.centre
    np.testing.assert_allclose(both.project(away).distance, whole.project(away).distance, atol=1e-9)


def test_groups_are_what_bonds_connect() -> None:
    bonds = [BondStrength("a", "c", 1.0, 1.0), BondStrength("c", "d", 1.0, 1.0), BondStrength("b", "x", 1.0, 1.0)]
    assert bonded_groups(["a", "b", "c", "d"], bonds) == [["a", "c", "d"], ["b"]]


def test_what_is_bonded_to_something_that_stands_does_not_fall() -> None:
    bonds = [BondStrength("a", "b", 1e4, 1e4), BondStrength("b", "c", 1e4, 1e4)]
    weightless = ObjectMaterial(density=0.0)
    contact = ContactSpecification(
        physical={"a": RUBBER, "b": RUBBER, "c": weightless, "d": RUBBER}, bonds=bonds, gravity=tuple(G)
    )
    assert falling_names(contact, SolveSpecification(0, 1)) == ["d"]


def test_rest_and_light_touches_are_no_strikes() -> None:
    """Closing speed that gravity gives in a step is rest; waves weaker than the bond open nothing."""
    from warpjld.fem.contact.obstacles.solids import Plane

    body, length = halves(), 1.0 / 240.0
    weakest = 2.0 * 3.0**0.5 * impedance(RUBBER)  # of a strike at 1 m/s [Pa]
    for speed, strength, strikes in ((0.0, 1.0, 0), (1.2, weakest, 1), (0.8, weakest, 0), (0.8, np.inf, 0)):
        body.restore(halves().state)
        body.centre, body.velocity = np.array([0.0, 0.01, 0.0]), np.array([0.0, -speed, 0.0])
        pressed = step_bodies([body], {"floor": Plane()}, G, lambda a, b: 0.5, time=0.0, step=1.0, length=length)
        bonds = [BondStrength("a", "b", strength, strength)]
        found = found_strikes([body], pressed, {"a": RUBBER, "b": RUBBER}, bonds, G, length)
        assert len(found) == strikes, speed
        assert [strike.on for strike in found] == [("floor",)] * strikes


@pytest.mark.slow
def test_a_fast_impact_opens_a_bond() -> None:
    found = dropped(0.2, 3e4, 8)
    assert found.bonds == []
    text = next(line for line in found.openings if "opens" in line)
    assert text.startswith("the bond of a and b opens at frame 6.")
    assert text.endswith("on impact on edge at 2 m/s")
    # from then on they are two: the inner ends stay above, the outer ends fall
    a, b = (found.paths[name].places[-1] for name in "ab")
    assert np.linalg.norm(a.rotation[0] - b.rotation[0]) > 1e-3


@pytest.mark.slow
def test_a_slow_impact_opens_nothing() -> None:
    found = dropped(0.013, 5e4, 4)
    assert [(bond.one, bond.other, bond.parted) for bond in found.bonds] == [("a", "b", ())]
    assert found.openings == ()
    a, b = (found.paths[name] for name in "ab")
    assert a.fate == b.fate
    apart = b.places[-1].position[0] - a.places[-1].position[0]
    assert np.linalg.norm(apart) == pytest.approx(0.06, abs=1e-6)  # still one
