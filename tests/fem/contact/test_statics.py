"""Whether friction could hold a body: statics says so, not a search that failed; inclines at μ from .1 to 1.2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.fem.contact.bodies import FREE, named, together
from warpjld.fem import Body, LinearElastic, Loads, NeoHooke, SolveStatus, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.interface.contact_interface import interfaces_of
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.contact.solver.statics import could_balance


def block(height: float) -> Body:
    return Body(box_hexes((0.1, 0.1, height), (4, 4, 2)), LinearElastic(1e6, 0.3))


def gravity(slope: float) -> np.ndarray:
    return 9.81 * np.array([np.sin(slope), 0.0, -np.cos(slope)])


def on_incline(friction: float, share: float) -> ContactSolution:
    """A flat block on a slope whose tangent is a share of the friction."""
    pull = Loads(gravity=tuple(gravity(np.arctan(share * friction))))
    return press(block(0.05), FREE, [Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=friction)], pull, check=False)


@pytest.mark.parametrize("share", [0.7, 0.98])
@pytest.mark.parametrize("friction", [0.1, 0.3, 0.6, 0.9, 1.2])
def test_below_the_limit_of_the_slope_it_stays(friction: float, share: float) -> None:
    found = on_incline(friction, share)
    assert found.status is SolveStatus.CONVERGED, found.message
    touch = found.last.touches[0]
    pulled = np.linalg.norm(touch.force[:2]) / touch.normal_force
    assert pulled == pytest.approx(share * friction, rel=2e-3)


@pytest.mark.parametrize("friction", [0.3, 0.9])
def test_two_meshes_on_a_slope(friction: float) -> None:
    """A block of 3 × 3 × 2 elements on one that deforms as well, at 85 % of the limit."""
    upper = named(box_hexes((0.1, 0.1, 0.05), (3, 3, 2)), "upper", (0.05, 0.05, 0.05))
    lower = named(box_hexes((0.2, 0.2, 0.05), (5, 5, 2)), "lower")
    body = together({"upper": (upper, NeoHooke(1e5, 0.3)), "lower": (lower, NeoHooke(1e5, 0.3))})
    held = prescribe(body.mesh, "lower.z-", x=0.0, y=0.0, z=0.0)
    pull = Loads(gravity=tuple(gravity(np.arctan(0.85 * friction))))
    touch = press(body, held, [Pair("upper.z-", "lower.z+", friction=friction)], pull).last.touches[0]
    assert np.linalg.norm(touch.force[:2]) / touch.normal_force == pytest.approx(0.85 * friction, rel=0.01)


@pytest.mark.parametrize("young", [1e4, 1e9])
def test_far_from_the_origin_it_stays_too(young: float) -> None:
    """5000 lengths away; positions are rounded there, and forces are not."""
    mesh, away = box_hexes((0.1, 0.1, 0.05), (3, 3, 2)), np.array([500.0, 150.0, -100.0])
    body = Body(replace(mesh, nodes=mesh.nodes + away), NeoHooke(young, 0.3))
    pull = Loads(gravity=(3.0, 0.0, -9.81))
    found = press(body, FREE, [Pair("z-", Plane(away, (0, 0, 1)), friction=0.6)], pull)
    np.testing.assert_allclose(found.last.touches[0].force, [-1.5, 0.0, 4.905], atol=1e-4)


@pytest.mark.parametrize(("height", "friction", "slope", "holds"), [
    (0.05, 0.5, 0.49, True),
    (0.05, 0.5, 0.51, False),
    (0.05, 1.2, 0.84 * 1.2, True),
    (0.20, 1.2, 0.45, True),
    (0.20, 1.2, 0.55, False),
])  # fmt: skip
def test_what_could_be_held(height: float, friction: float, slope: float, holds: bool) -> None:
    """Slopes by their tangent; a block .1 wide slides above μ, and tips over above .1 / height."""
    body = block(height)
    interfaces = interfaces_of(body.mesh, [Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=friction)], 1)
    x = body.mesh.nodes
    force = np.tile(gravity(np.arctan(slope)), (len(x), 1)) * _share_of_mass(body)[:, None]
    points = [interfaces[0].points(x, 0.0, 1.0)]
    nodes, held = np.arange(len(x)), np.empty(0, np.int64)
    assert could_balance(nodes, x, force, held, interfaces, points) is holds


def _share_of_mass(body: Body) -> np.ndarray:
    from warpjld.fem.load.loads import volumes

    share = np.zeros(len(body.mesh.nodes))
    np.add.at(share, body.mesh.elements, volumes(body.mesh).sum(axis=1)[:, None] / 8.0)
    return share
