"""Corners and edges finer than the faces they meet: their area, and what is said where a mesh does not see them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.fem.contact.bodies import named, together
from warpjld.fem import Body, HexMesh, NeoHooke, ball_hexes, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, ContactWarning, Pair, press
from warpjld.fem.contact.obstacles.solids import Box, Plane

LAW = NeoHooke(1e5, 0.4)


def on_its_corner() -> tuple[HexMesh, np.ndarray]:
    """A cube of .02 m that stands on a corner, 10 µm above z = 0, and its upper nodes."""
    mesh = box_hexes((0.02, 0.02, 0.02), (4, 4, 4))
    turn = Rotation.align_vectors([[0.0, 0.0, -1.0]], [[1.0, 1.0, 1.0]])[0]
    x = turn.apply(mesh.nodes - mesh.nodes.mean(axis=0))
    x[:, 2] -= x[:, 2].min() - 1e-5
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
    with pytest.warns(
        ContactWarning, match=r"contact 'corner': a corner or an edge lies 0\.99 mm inside the other side"
    ):
        press(body, held, [Pair(*(sides if slave == "upper" else sides[::-1]), name="corner")])


def test_an_edge_of_an_obstacle_between_nodes_is_told_of() -> None:
    with pytest.warns(ContactWarning, match='obstacle enters a face by .* mm between its nodes.*sites="faces"'):
        missed = ball_over_an_edge("nodes", 0.003)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        met = ball_over_an_edge("faces", 0.003)
        whole = ball_over_an_edge("nodes", -0.02)
    forces = [found.last.touches[0].normal_force for found in (missed, met, whole)]
    assert forces[0] < 0.6 * forces[1] < forces[1] < forces[2]
