"""The contact patch test: a uniform pressure passes through meshes that do not match (Taylor & Papadopoulos 1991)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.fem import Body, LinearElastic, Loads, Material, NeoHooke, Prescribed, box_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.output.stress import cauchy

YOUNG = 1.0


def blocks(law: Material) -> Body:
    lower, upper = box_hexes((1, 1, 0.5), (3, 3, 2)), box_hexes((1, 1, 0.5), (4, 5, 2))
    return together({"a": (named(lower, "a"), law), "b": (named(upper, "b", (0, 0, 0.5)), law)})


def held(body: Body) -> Prescribed:
    """The planes x = 0, y = 0 and z = 0 stay."""
    sides = [np.flatnonzero(body.mesh.nodes[:, axis] == 0.0) for axis in range(3)]
    return (
        prescribe(body.mesh, sides[0], x=0.0)
        + prescribe(body.mesh, sides[1], y=0.0)
        + prescribe(body.mesh, sides[2], z=0.0)
    )


def standing(body: Body) -> Prescribed:
    """The lower block stands on z = 0; the upper one is held by friction alone."""
    nodes = body.mesh.nodes
    below = np.flatnonzero(nodes[:, 2] == 0.0)
    corner, other = (np.flatnonzero((nodes == place).all(axis=1)) for place in ([0, 0, 0], [1, 0, 0]))
    return (
        prescribe(body.mesh, below, z=0.0)
        + prescribe(body.mesh, corner, x=0.0, y=0.0)
        + prescribe(body.mesh, other, y=0.0)
    )


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("pair", [("a.z+", "b.z-"), ("b.z-", "a.z+")], ids=["coarse slave", "fine slave"])
def test_uniform_pressure_passes(pair: tuple[str, str], friction: float) -> None:
    """At a strain of 1e-6, where the blocks' sideways growth under the mortar integrals is of second order."""
    body = blocks(LinearElastic(YOUNG, 0.3))
    pressure = 1e-6 * YOUNG
    loads = Loads(traction={"b.z+": (0.0, 0.0, -pressure)})
    known = standing(body) if friction else held(body)
    reached = press(body, known, [Pair(*pair, friction=friction)], loads, tolerance=1e-7, penetration=1e-6).last
    stress = cauchy(body, reached.displacement) / pressure
    np.testing.assert_allclose(stress, np.broadcast_to([0, 0, -1, 0, 0, 0], stress.shape), atol=2e-5)
    touch = reached.touches[0]
    np.testing.assert_allclose(touch.pressure, pressure, rtol=2e-5)
    np.testing.assert_allclose(touch.contact_area, 1.0, rtol=1e-5)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_uniform_pressure_passes_at_large_strain(friction: float) -> None:
    """Blocks squeezed by a fifth grow sideways alike: the surfaces keep matching, and the stress stays uniform as far
    as the overlap that is left (1e-4 of an edge) lets it."""
    body = blocks(NeoHooke(YOUNG, 0.3))
    squeezed = held(body) + prescribe(body.mesh, "b.z+", z=-0.2)
    pair = Pair("a.z+", "b.z-", friction=friction)
    found = press(body, squeezed, [pair], times=(0.25, 0.5, 0.75, 1.0), penetration=1e-4)
    stress = cauchy(body, found.last.displacement)
    mean = stress[:, 2].mean()
    assert mean < -0.15
    assert np.ptp(stress[:, 2]) < 2e-3 * abs(mean)
    assert np.abs(stress[:, [0, 1, 3, 4, 5]]).max() < 2e-3 * abs(mean)
