"""Contact with what lies outside a mesh is contact with a mesh that reaches there."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import lid, named, together
from warpjld.errors import InputError
from warpjld.fem import Body, LinearElastic, box_hexes, merge, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.mesh.hexmesh import HexMesh

SKIN = 0.03


def block() -> HexMesh:
    return box_hexes(counts=(3, 3, 3))


@pytest.mark.parametrize("sites", ["nodes", "faces"])
def test_an_offset_is_as_a_plate_that_is_nearer(sites: str) -> None:
    mesh = block()
    held = prescribe(mesh, "z-", x=0.0, y=0.0, z=0.0)
    body = Body(mesh, LinearElastic(1.0, 0.3))
    offset = np.full(len(mesh.nodes), SKIN)
    one = press(body, held, [Pair("z+", lid(0.1 - SKIN, height=1.0), offset=offset, sites=sites)]).last
    other = press(body, held, [Pair("z+", lid(0.1, height=1.0), sites=sites)]).last
    np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-4)
    assert one.touches[0].force[2] == pytest.approx(other.touches[0].force[2], rel=1e-3)


def test_offsets_of_both_sides_add_up() -> None:
    law = LinearElastic(1.0, 0.3)
    body = together(
        {"a": (named(block(), "a"), law), "b": (named(box_hexes(counts=(2, 2, 2)), "b", (0.1, 0.1, 1.0)), law)}
    )
    mesh = body.mesh
    offset = np.full(len(mesh.nodes), 0.5 * SKIN)
    held = prescribe(mesh, "a.z-", x=0.0, y=0.0, z=0.0)
    found = []
    for down, offsets in ((0.1 - SKIN, offset), (0.1, None)):
        known = held + prescribe(mesh, "b.z+", x=0.0, y=0.0, z=-down)
        found.append(press(body, known, [Pair("a.z+", "b.z-", offset=offsets)], times=(0.5, 1.0)).last)
    assert found[0].touches[0].force[2] == pytest.approx(found[1].touches[0].force[2], rel=0.02)


def test_slivers_are_no_constraint_however_far_skin_lies_outside() -> None:
    """A block is drawn off another sideways, .2 above it: what a node of the lower one shares with it shrinks to a
    sliver and to nothing. Skin half an edge outside each touches there as long as the share is whole, lets go ever
    more as it fades, and is nowhere a constraint where hardly anything is left (one of 3e-4 edge² had no solution)."""
    mesh = merge(named(block(), "a"), named(block(), "b", (0.0, 0.0, 1.2)))
    offset = np.full(len(mesh.nodes), 0.5 / 3.0)
    interface = Interface(mesh, Pair("a.z+", "b.z-", offset=offset), 1)
    edge, upper = 1.0 / 3.0, np.flatnonzero(mesh.nodes[:, 2] > 1.1)
    node = int(np.argmin(np.linalg.norm(mesh.nodes[interface.slave.nodes] - (0.0, 1.0 / 3.0, 1.0), axis=1)))
    gaps, shares = [], []
    for way in np.linspace(0.0, 1.0, 41) * edge:
        x = mesh.nodes.copy()
        x[upper, 0] += way
        found = interface.points(x, 0.0, 0.0)
        here = np.flatnonzero(found.sites == node)
        assert (found.area > 0.05 * edge**2).all()
        if len(here):
            gaps.append(float(found.gap[here[0]]))
            shares.append(float(found.area[here[0]]) / edge**2)
    assert gaps[0] == pytest.approx(0.2 - 2.0 * 0.5 / 3.0)
    assert (np.diff(shares) < 0.0).all()
    assert shares[-1] < 0.1
    assert (np.diff(gaps) > -1e-12).all()
    assert gaps[-1] > 0.0
    assert len(gaps) < 41


@pytest.mark.parametrize(
    ("offset", "message"), [(np.zeros(3), "want 64 lengths, one a node, got 3"), (np.full(64, np.nan), "finite length")]
)
def test_offsets_that_are_none(offset: np.ndarray, message: str) -> None:
    mesh = block()
    held = prescribe(mesh, "z-", x=0.0, y=0.0, z=0.0)
    with pytest.raises(InputError, match=message):
        press(Body(mesh, LinearElastic(1.0, 0.3)), held, [Pair("z+", lid(0.1), offset=offset)])
