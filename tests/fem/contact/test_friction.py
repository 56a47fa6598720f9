"""Coulomb friction: a block on an incline, and one carried along by what it lies on."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import FREE
from warpjld.fem import Body, LinearElastic, Loads, SolveStatus, box_hexes
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane

SLOPE = np.radians(20.0)
GRAVITY = 9.81 * np.array([np.sin(SLOPE), 0.0, -np.cos(SLOPE)])


@pytest.fixture(scope="module")
def block() -> Body:
    return Body(box_hexes((0.1, 0.1, 0.05), (3, 3, 2)), LinearElastic(1e6, 0.3))


def test_friction_of_the_slope_and_a_hundredth_more_holds(block: Body) -> None:
    pair = Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=1.01 * np.tan(SLOPE))
    reached = press(block, FREE, [pair], Loads(gravity=tuple(GRAVITY)), times=(0.5, 1.0)).last
    weight = 1000.0 * 0.1 * 0.1 * 0.05 * GRAVITY
    np.testing.assert_allclose(reached.touches[0].force, -weight, rtol=0, atol=1e-4 * np.linalg.norm(weight))
    assert np.abs(reached.displacement).max() < 1e-4


def test_a_hundredth_less_slides(block: Body) -> None:
    pair = Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=0.99 * np.tan(SLOPE), name="slope")
    found = press(block, FREE, [pair], Loads(gravity=tuple(GRAVITY)), times=(0.5, 1.0), check=False)
    assert found.status is SolveStatus.SLIDING
    assert "slope" in found.message


@pytest.mark.parametrize(("halvings", "told"), [(None, 3), pytest.param(1, 1, marks=pytest.mark.slow), (0, 0)])
def test_steps_are_halved_as_often_as_asked(block: Body, halvings: int | None, told: int) -> None:
    pair = Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=0.9 * np.tan(SLOPE))
    lines: list[str] = []
    found = press(
        block, FREE, [pair], Loads(gravity=tuple(GRAVITY)), halvings=halvings, check=False, progress=lines.append
    )
    assert found.status is SolveStatus.SLIDING
    assert sum("halving" in line for line in lines) == told


def test_a_moving_plane_carries_a_block_along(block: Body) -> None:
    """By friction alone, through ten steps of half a block: nothing creeps."""
    way = np.array([0.5, 0.1, 0.0])
    floor = Plane((0, 0, 0), (0, 0, 1), motion=lambda t: (way * t, (0, 0, 0, 1)))
    times = np.arange(1, 11) / 10
    gravity = Loads(gravity=(0.0, 0.0, -9.81))

    def guess(before: float, time: float, u: np.ndarray) -> np.ndarray:
        return u + (time - before) * way if before else u

    for start in (None, guess):
        found = press(block, FREE, [Pair("z-", floor, friction=0.3)], lambda t: gravity, times=times, guess=start)
        for instant in found.instants:
            middle = instant.displacement.mean(axis=0)
            np.testing.assert_allclose(middle[:2], way[:2] * instant.time, atol=1e-5)
            np.testing.assert_allclose(instant.touches[0].force, [0.0, 0.0, 4.905], atol=5e-4)


def test_a_plane_without_friction_leaves_a_block_where_it_is(block: Body) -> None:
    floor = Plane((0, 0, 0), (0, 0, 1), motion=lambda t: ((0.01 * t, 0, 0), (0, 0, 0, 1)))
    found = press(block, FREE, [Pair("z-", floor)], lambda t: Loads(gravity=(0.0, 0.0, -9.81)), times=(0.5, 1.0))
    assert np.abs(found.last.displacement[:, :2].mean(axis=0)).max() < 1e-6


def test_a_sliding_block_is_pulled_by_mu_times_its_weight(block: Body) -> None:
    """The far end is held: the floor that goes by pulls at it with Coulomb's force along its way."""
    from warpjld.fem import prescribe

    friction, way = 0.25, np.array([0.03, 0.04, 0.0])
    floor = Plane((0, 0, 0), (0, 0, 1), motion=lambda t: (way * t, (0, 0, 0, 1)))
    held = prescribe(block.mesh, "z+", x=0.0, y=0.0)
    gravity = Loads(gravity=(0.0, 0.0, -9.81))
    found = press(block, held, [Pair("z-", floor, friction=friction)], lambda t: gravity, times=(0.25, 0.5, 1.0))
    touch = found.last.touches[0]
    np.testing.assert_allclose(touch.force[:2], friction * touch.force[2] * way[:2] / 0.05, rtol=2e-3)
    np.testing.assert_allclose(touch.force[2], 4.905, rtol=1e-4)
    np.testing.assert_allclose(touch.sliding, 1.0)
    np.testing.assert_allclose(found.last.reactions.sum(axis=0)[:2], -touch.force[:2], rtol=1e-3)


def test_a_body_that_nothing_touches_is_named(block: Body) -> None:
    away = Pair("z-", Plane((0, 0, -1.0), (0, 0, 1)), friction=0.5)
    found = press(block, FREE, [away], Loads(gravity=(9.81, 0.0, 0.0)), check=False)
    assert found.status is SolveStatus.UNHELD
    assert found.message.endswith("nothing holds 'body'")


def test_a_body_that_swings_on_one_held_point_is_told_so(block: Body) -> None:
    from warpjld.fem import prescribe

    away = Pair("z-", Plane((0, 0, -9.0), (0, 0, 1)), friction=0.5)
    corner = prescribe(block.mesh, np.array([0]), x=0.0, y=0.0, z=0.0)
    found = press(block, corner, [away], Loads(gravity=(9.81, 0.0, 0.0)), check=False)
    assert found.status is SolveStatus.UNHELD
    assert found.message.endswith("the one prescribed point of 'body' cannot hold it")
