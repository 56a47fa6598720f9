"""Corners and edges finer than the faces they meet: their area, and what is said where a mesh does not see them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.fem.contact.bodies import named, together
from warpjld.fem import Body, HexMesh, LinearElastic, NeoHooke, ball_hexes, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, ContactWarning, Pair, press
from warpjld.fem.contact.obstacles.solids import Box, Plane

LAW = NeoHooke(1e5, 0.4)


def on_its_corner(tilt: float = 0.0, n: int = 4) -> tuple[HexMesh, np.ndarray]:
    """A cube of .02 m that stands on a corner, tilted [°], 10 µm above z = 0, and its upper nodes."""
    mesh = box_hexes((0.02, 0.02, 0.02), (n, n, n))
    turn = Rotation.align_vectors([[0.0, 0.0, -1.0]], [[1.0, 1.0, 1.0]])[0]
    turn = Rotation.from_rotvec(np.radians(tilt) / np.sqrt(2.0) * np.array([1.0, -1.0, 0.0])) * turn
    x = turn.apply(mesh.nodes - mesh.nodes.mean(axis=0))
    x -= x[np.argmin(x[:, 2])] - [0.0, 0.0, 1e-5]
    return replace(mesh, nodes=x), np.flatnonzero(x[:, 2] > 0.7 * x[:, 2].max())


def ball_over_an_edge(sites: str, above: float = 0.0) -> ContactSolution:
    """A ball of .01 m pressed by 2 mm on a table whose edge lies behind its middle by ``above``."""
    mesh = ball_hexes(0.01, n=6)
    held = prescribe(mesh, np.flatnonzero(mesh.nodes[:, 2] > 0.005), x=0.0, y=0.0, z=-0.002)
    table = Box((0.1, 0.1, 0.02), centre=(-0.05 - above, 0.0, -0.0201))
    return press(Body(mesh, LAW), held, [Pair("outer", table, sites=sites)])


def test_one_pressed_corner_has_an_area() -> None:
    """Force over a mean pressure of E* tan β / 2, β = 35° being how its flanks stand off."""
    mesh, top = on_its_corner()
    floor = Pair(mesh.boundary(), Plane((0, 0, 0), (0, 0, 1)), name="floor")
    held = prescribe(mesh, top, x=0.0, y=0.0, z=-1e-4)
    touch = press(Body(mesh, LAW), held, [floor]).last.touches[0]
    assert touch.active.sum() == 1
    mean = 0.5 * 1e5 / (1.0 - 0.4**2) * np.sqrt(0.5)
    assert touch.normal_force / touch.contact_area == pytest.approx(mean, rel=0.1)


@pytest.mark.parametrize("slave", ["upper", "lower"])
def test_a_corner_that_a_mesh_does_not_see_is_told_of(slave: str) -> None:
    mesh, top = on_its_corner()
    lower = named(box_hexes((0.04, 0.04, 0.01), (5, 5, 2)), "lower", (-0.02, -0.02, -0.01))
    body = together({"upper": (named(mesh, "upper"), LAW), "lower": (lower, LAW)})
    held = prescribe(body.mesh, "lower.z-", x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, top, x=0.0, y=0.0, z=-0.001)
    sides = (mesh.boundary(), "lower.z+")
    with pytest.warns(ContactWarning, match=r"'corner': a corner or an edge lies 0\.99 mm inside the other side"):
        press(body, held, [Pair(*(sides if slave == "upper" else sides[::-1]), name="corner")])


def test_a_corner_that_presses_between_nodes_is_told_of() -> None:
    """Tilted by 10° on a finer floor that is the slave: the forces are .3 of what the other choice of slave gives."""
    mesh, top = on_its_corner(10.0, 8)
    floor = named(box_hexes((0.016, 0.016, 0.008), (8, 8, 4)), "floor", (-0.007, -0.0067, -0.008))
    body = together({"cube": (named(mesh, "cube"), LAW), "floor": (floor, LAW)})
    held = prescribe(body.mesh, "floor.z-", x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, top, x=0.0, y=0.0, z=-0.0015)
    with pytest.warns(ContactWarning, match="a corner or an edge that presses lies .* mm inside the other side"):
        found = press(body, held, [Pair("floor.z+", mesh.boundary())])
    assert found.last.touches[0].normal_force > 0.0


def two_balls(slave: str, master: str) -> list[str]:
    """Warnings of a ball of eight elements (a) pressed by one of four (b)."""
    a, b = named(ball_hexes(1.0, n=8), "a"), named(ball_hexes(1.0, n=4), "b", (0.03, 0.02, 2.0))
    body = together({"a": (a, LinearElastic(1.0, 0.3)), "b": (b, LinearElastic(1.0, 0.3))})
    height = body.mesh.nodes[:, 2]
    low, top = np.flatnonzero(height < -0.3), np.flatnonzero(height > 2.3)
    held = prescribe(body.mesh, low, x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, top, x=0.0, y=0.0, z=-0.15)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        press(body, held, [Pair(slave, master)])
    return [str(one.message) for one in told if issubclass(one.category, ContactWarning)]


def test_ridges_between_facets_larger_than_the_slaves_are_told_of() -> None:
    """Pressures of the finer slave differ from Hertz's by up to .38 of the peak; the force by 3 %."""
    (told,) = two_balls("a.outer", "b.outer")
    assert "the master's facets are larger than the slave's" in told
    assert "pressures scatter by up to" in told
    assert two_balls("b.outer", "a.outer") == []  # a coarser slave averages over them


def test_an_edge_of_an_obstacle_between_nodes_is_told_of() -> None:
    with pytest.warns(ContactWarning, match='obstacle enters a face by .* mm between its nodes.*sites="faces"'):
        missed = ball_over_an_edge("nodes", 0.003)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        met = ball_over_an_edge("faces", 0.003)
        whole = ball_over_an_edge("nodes", -0.02)
    forces = [found.last.touches[0].normal_force for found in (missed, met, whole)]
    assert forces[0] < 0.6 * forces[1] < forces[1] < forces[2]
