"""What contact leaves on both sides: sums that agree, and a block that is dragged by a known way."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import named
from warpjld.fem import Body, LinearElastic, Loads, ball_hexes, box_hexes, merge, prescribe
from warpjld.fem.contact import ContactInstant, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.contact.results.nodal_contact import stacked, tributary_areas
from warpjld.simulation.report.tactile import tactile_of_pairs

STEP, FRICTION, DEPTH = 2e-4, 0.3, 1e-4


@pytest.fixture(scope="module")
def dragged() -> tuple[Body, list[ContactInstant]]:
    """A soft pad pressed on a wide block whose elements do not match its own, and drawn over it, step by step."""
    pad = named(box_hexes((0.02, 0.02, 0.01), (4, 4, 2)), "pad", (0.0, 0.0, 0.01))
    floor = named(box_hexes((0.06, 0.05, 0.01), (7, 6, 2)), "floor", (-0.015, -0.015, 0.0))
    mesh = merge(pad, floor)
    body = Body(mesh, {"pad": LinearElastic(5e4, 0.3), "floor": LinearElastic(2e5, 0.3)})
    still = prescribe(mesh, "floor.z-", x=0.0, y=0.0, z=0.0)

    def way(time: float) -> float:
        return STEP * (0.1 * min(max(0.0, time - 1.0), 1.0) + max(0.0, time - 2.0))

    def held(time: float):  # type: ignore[no-untyped-def]
        return prescribe(mesh, "pad.z+", x=way(time), y=0.0, z=-DEPTH * min(time, 1.0)) + still

    pair = Pair("pad.z-", "floor.z+", friction=FRICTION, name="pad")
    found = press(body, held, [pair], times=[float(t) for t in range(1, 9)], tolerance=1e-6)
    return body, list(found.instants)


def test_both_sides_feel_the_same(dragged: tuple[Body, list[ContactInstant]]) -> None:
    body, instants = dragged
    count = len(body.mesh.nodes)
    pad = np.zeros(count, dtype=bool)
    pad[np.unique(body.mesh.quads(body.mesh.face_set("pad.z-")))] = True
    for instant in instants:
        touch = instant.touches[0]
        nodal_contact = touch.nodal_contact
        for name, whole in (
            ("force", touch.normal_force),
            ("area", touch.contact_area),
            ("held", touch.held.sum()),
            ("slid", touch.pressed @ np.linalg.norm(touch.slip, axis=1)),
        ):
            values = getattr(nodal_contact, name)
            assert values[pad].sum() == pytest.approx(whole, rel=1e-9, abs=1e-18), name
            assert values[~pad].sum() == pytest.approx(whole, rel=1e-9, abs=1e-18), name
            assert (values >= 0.0).all()
        lift = touch.nodal[pad, 2].sum()
        assert nodal_contact.force[pad].sum() == pytest.approx(lift, rel=2e-3)


def test_a_pad_that_slides_feels_how_far(dragged: tuple[Body, list[ContactInstant]]) -> None:
    """At first it shears and sticks; when all of it slides, it goes as far along the floor as it is drawn."""
    _, instants = dragged
    felt = tactile_of_pairs(instants)
    assert felt.sticking[1, 0] > 0.5
    assert felt.slip[1, 0] < 0.1 * STEP
    assert (np.hypot(felt.force[1, 0, 0], felt.force[1, 0, 1]) < 0.9 * FRICTION * felt.normal_force[1, 0]).all()
    np.testing.assert_allclose(felt.sticking[-3:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(felt.slip[-3:, 0], STEP, rtol=0.02)
    tangential = np.hypot(felt.force[-3:, 0, 0], felt.force[-3:, 0, 1])
    np.testing.assert_allclose(tangential, FRICTION * felt.normal_force[-3:, 0], rtol=5e-3)
    assert (felt.force[-3:, 0, 0] < 0.0).all()  # against the way it is drawn
    # its centre goes where it goes
    way = np.diff(felt.centre[-4:, 0], axis=0)
    np.testing.assert_allclose(way[:, 0], STEP, rtol=0.05)
    np.testing.assert_allclose(way[:, 1], 0.0, atol=0.02 * STEP)
    np.testing.assert_allclose(felt.area[:, 0], instants[-1].touches[0].contact_area, rtol=0.05)


def test_an_obstacle_leaves_its_imprint_on_the_slave_alone() -> None:
    body = Body(ball_hexes(0.01, n=4), LinearElastic(1e5, 0.3))
    top = np.flatnonzero(body.mesh.nodes[:, 2] > 0.007)
    pair = Pair("outer", Plane((0, 0, -0.0097), (0, 0, 1)))
    found = press(body, prescribe(body.mesh, top, x=0, y=0, z=0), [pair], Loads()).last
    touch = found.touches[0]
    assert touch.nodal_contact.force.sum() == pytest.approx(touch.normal_force)
    assert touch.nodal_contact.area.sum() == pytest.approx(touch.contact_area)
    x = body.mesh.nodes + found.displacement
    pressure = touch.nodal_contact.force[touch.nodes] / tributary_areas(body.mesh, "outer", x)[touch.nodes]
    np.testing.assert_allclose(pressure, np.maximum(touch.pressure, 0.0), rtol=1e-5)


def test_several_pairs_are_stacked() -> None:
    assert stacked([], 5).force.shape == (0, 5)
