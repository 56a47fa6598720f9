"""Contact that opens again, bodies that start inside one another, pairs that never touch, going on from a solution."""

from __future__ import annotations

import numpy as np

from tests.fem.contact.bodies import lid, mean_gaps, named, symmetric, together
from warpjld.fem import Body, LinearElastic, NeoHooke, Prescribed, ball_hexes, box_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane


def squeezed() -> tuple[Body, Prescribed, Plane]:
    """An octant of a ball under a plate that comes down, and goes up again from time 1 to 2."""
    mesh = ball_hexes(1.0, n=4, octant=True)
    plate = Plane((0, 0, 1), (0, 0, -1), motion=lambda t: ((0.0, 0.0, -0.1 * min(t, 2.0 - t)), (0, 0, 0, 1)))
    return Body(mesh, NeoHooke(1.0, 0.45)), symmetric(mesh), plate


def test_released_contact_leaves_nothing_behind() -> None:
    body, held, plate = squeezed()
    for friction in (0.0, 0.3):
        found = press(body, lambda t: held, [Pair("outer", plate, friction=friction)], times=np.arange(1, 11) / 5)
        force = [instant.touches[0].normal_force for instant in found.instants]
        assert force[4] == max(force) > 0.0
        if friction == 0.0:  # the way back is the way there
            np.testing.assert_allclose(force[5:9], force[3::-1], rtol=1e-3)
        assert force[-1] < 1e-9 * max(force)
        assert np.abs(found.last.displacement).max() < 1e-7
        assert np.abs(found.last.reactions).max() < 1e-7 * max(force)


def test_goes_on_from_a_solution() -> None:
    """In two runs as in one, friction's memory included."""
    body, held, plate = squeezed()
    pairs = [Pair("outer", plate, friction=0.3)]
    once = press(body, lambda t: held, pairs, times=(0.5, 1.0, 1.3))
    first = press(body, lambda t: held, pairs, times=(0.5, 1.0))
    then = press(body, lambda t: held, pairs, times=(1.3,), after=first)
    np.testing.assert_allclose(then.last.touches[0].force, once.last.touches[0].force, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(then.last.displacement, once.last.displacement, atol=1e-5)


def overlapping() -> Body:
    """Two balls that start a tenth of a radius inside one another."""
    a, b = named(ball_hexes(1.0, n=6), "a"), named(ball_hexes(1.0, n=4), "b", (0.02, 0.01, 1.9))
    return together({"a": (a, NeoHooke(1.0, 0.45)), "b": (b, NeoHooke(1.0, 0.45))})


def test_overlap_at_the_start_is_resolved_gradually() -> None:
    """By the first time all of it is gone; half-way there half of it was (R112)."""
    body = overlapping()
    at = body.mesh.nodes[:, 2]
    held = prescribe(body.mesh, np.flatnonzero(at < -0.4), x=0.0, y=0.0, z=0.0)
    held += prescribe(body.mesh, np.flatnonzero(at > 2.3), x=0.0, y=0.0, z=0.0)
    found = press(body, held, [Pair("a.outer", "b.outer")], times=(1.0, 2.0))
    edge = 2.0 / 6
    for instant in found.instants:
        assert instant.touches[0].penetration < 1e-3 * edge
        assert np.abs(mean_gaps(body, instant, "a.outer", "b.outer")).max() < 5e-3 * edge
    forces = [instant.touches[0].force for instant in found.instants]
    assert forces[0][2] < 0.0
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-3, atol=1e-6)


def test_a_pair_that_never_touches() -> None:
    mesh = ball_hexes(1.0, n=4, octant=True)
    found = press(Body(mesh, LinearElastic(1.0, 0.3)), symmetric(mesh), [Pair("outer", lid(0.1, height=5.0))])
    touch = found.last.touches[0]
    assert len(touch.nodes) == 0
    assert touch.normal_force == touch.contact_area == touch.peak == touch.penetration == 0.0
    assert np.isnan(touch.centre).all()
    assert np.isnan(touch.sliding)
    assert not touch.nodal.any()
    assert np.abs(found.last.displacement).max() < 1e-12


def test_two_bodies_that_never_touch() -> None:
    parts = {
        name: (named(box_hexes(counts=(2, 2, 2)), name, (0, 0, z)), LinearElastic(1.0, 0.3))
        for name, z in (("a", 0), ("b", 9))
    }
    body = together(parts)
    held = prescribe(body.mesh, "a.z-", x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, "b.z+", x=0.0, y=0.0, z=0.0)
    found = press(body, held, [Pair("a.z+", "b.z-", friction=0.5)])
    assert found.last.touches[0].normal_force == 0.0
