"""Contact at edges and corners of either side: gaps are distances, and their derivatives are those of the gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.fem.contact.bodies import named
from warpjld.fem import HexMesh, box_hexes, merge
from warpjld.fem.contact import Pair
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, initial_state
from warpjld.fem.contact.law.return_mapping import return_mapping
from warpjld.fem.contact.solver.tangent import linearise_mortar

EDGE = 0.005
"""Edge of the slave's elements [m]; those of the other side are twice as long."""


def facing(turn: Rotation, apart: float, offset: float = 0.0, wavy: float = 0.0) -> tuple[HexMesh, Interface]:
    """A block of 0.02 m, turned, whose lowest point lies ``apart`` above a larger one [m]; it is the slave."""
    upper = box_hexes((0.02, 0.02, 0.02), (4, 4, 4), origin=(-0.01, -0.01, -0.01))
    x = turn.apply(upper.nodes)
    x += [0.002, -0.0015, apart - x[:, 2].min()]
    lower = named(box_hexes((0.08, 0.08, 0.02), (8, 8, 2)), "table", (-0.04, -0.04, -0.02))
    skin = replace(upper, nodes=x, faces={"block": upper.boundary()})
    mesh = merge(skin, lower)
    rng = np.random.default_rng(1)
    mesh = replace(mesh, nodes=mesh.nodes + wavy * EDGE * rng.normal(size=mesh.nodes.shape))
    seen = offset * np.ones(len(mesh.nodes)) * (np.arange(len(mesh.nodes)) < len(upper.nodes))
    return mesh, Interface(mesh, Pair("block", "table.z+", offset=seen), 1)


TURNS = {
    "face": Rotation.identity(),
    "edge": Rotation.from_euler("x", 45.0, degrees=True),
    "edge of one side": Rotation.from_euler("x", 8.0, degrees=True),
    "corner": Rotation.align_vectors([[0.0, 0.0, -1.0]], [[1.0, 1.0, 1.0]])[0],
    "corner of one side": Rotation.from_euler("xy", [6.0, 5.0], degrees=True),
}


@pytest.mark.parametrize("offset", [0.0, 2e-4, 4e-4])
def test_a_face_is_as_far_off_at_its_edges_as_in_its_middle(offset: float) -> None:
    """Nodes on the rim of the touching face: their other faces turn aside, and do not turn the direction of the gap."""
    mesh, interface = facing(TURNS["face"], 3e-4, offset)
    points = interface.points(mesh.nodes, 0.0, 0.0)
    assert len(points.sites) == 25
    np.testing.assert_allclose(points.normal, np.tile([0.0, 0.0, -1.0], (25, 1)), atol=1e-12)
    np.testing.assert_allclose(points.gap, 3e-4 - offset, atol=1e-12)


def opened(interface: Interface, x: NDArray[np.float64], points: ContactPoints) -> ContactPoints:
    """Points with the derivatives of their gaps, all taken as touching."""
    state = initial_state(len(interface.edge), interface.pair)
    pressure = np.zeros(len(interface.edge))
    pressure[points.sites] = 1.0
    state = replace(state, pressure=pressure)
    penalty = np.full(len(points.sites), 1.0)
    slip = np.zeros((len(points.sites), 3))
    tractions = return_mapping(interface.pair, points, state, slip, penalty, 0.0, ActiveSet.FROZEN)
    tractions = replace(tractions, error=np.zeros_like(tractions.error))
    assert interface.mortar is not None
    found = linearise_mortar(interface.mortar, points, tractions, state, penalty, x, interface.reach)
    assert found is not None
    return replace(points, gap_derivative=found.gap)


@pytest.mark.parametrize("where", TURNS)
@pytest.mark.parametrize("apart", [2e-4, -5e-4])
def test_derivatives_of_gaps_at_faces_edges_and_corners(where: str, apart: float) -> None:
    mesh, interface = facing(TURNS[where], apart, 2e-4, wavy=0.02)
    x, step = mesh.nodes, 1e-8
    points = opened(interface, x, interface.points(x, 0.0, 0.0))
    rng = np.random.default_rng(4)
    for _ in range(3):
        way = rng.normal(size=x.shape)
        ends = [interface.points(x + sign * step * way, 0.0, 0.0) for sign in (1.0, -1.0)]
        assert all(np.array_equal(end.sites, points.sites) for end in ends)
        difference = (ends[0].gap - ends[1].gap) / (2.0 * step)
        np.testing.assert_allclose(points.opened(way), difference, rtol=0, atol=2e-5 * np.abs(difference).max())


@pytest.mark.parametrize("where", TURNS)
def test_gaps_open_as_the_sides_part(where: str) -> None:
    """Moved away along its normal a point opens by nearly as much, by the derivative and in fact."""
    mesh, interface = facing(TURNS[where], -2e-4, 2e-4)
    x = mesh.nodes
    points = opened(interface, x, interface.points(x, 0.0, 0.0))
    upper = np.arange(len(x)) < 125
    near = points.gap < 0.5 * EDGE
    assert near.any()
    for row in np.flatnonzero(near):
        away = np.where(upper[:, None], -points.normal[row], 0.0)
        further = interface.points(x + 1e-5 * away, 0.0, 0.0)
        assert points.opened(away)[row] > 0.5
        assert further.gap[further.sites == points.sites[row]] > points.gap[row] + 0.5e-5
