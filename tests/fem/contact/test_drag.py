"""A viscous medium around bodies that nothing else holds."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Body, LinearElastic, Prescribed, box_hexes
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.load.loads import Loads

EDGE, FORCE, VISCOSITY = 0.01, 0.2, 50.0  # [m], [N], [N per m and unit of time]
NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))


@pytest.fixture
def block() -> Body:
    mesh = box_hexes((EDGE, EDGE, EDGE), (1, 1, 1), name="block")
    return Body(mesh, {"block": LinearElastic(1e6, 0.3)})


def loads(body: Body, force: float) -> Loads:
    """A force [N] along z, and the medium, both shared alike by all nodes."""
    count = len(body.mesh.nodes)
    return Loads(nodal=np.tile([0.0, 0.0, force / count], (count, 1)), drag=np.full(count, VISCOSITY / count))


def test_a_free_block_moves_at_the_speed_of_force_over_viscosity(block: Body) -> None:
    floor = Pair("z-", Plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)), friction=0.5)
    times = (1.0, 1.5, 4.0)
    found = press(block, lambda time: NOTHING, [floor], lambda time: loads(block, FORCE), times=times)
    for instant in found.instants:
        moved = instant.displacement
        np.testing.assert_allclose(moved[:, 2], instant.time * FORCE / VISCOSITY, rtol=1e-6)
        assert np.abs(moved[:, :2]).max() < 1e-9


def test_no_force_is_left_once_it_rests(block: Body) -> None:
    floor = Pair("z-", Plane((0.0, 0.0, -1e-3), (0.0, 0.0, 1.0)), friction=0.5)
    found = press(
        block, lambda time: NOTHING, [floor], lambda time: loads(block, -FORCE), times=(0.1, 10.0, 20.0, 30.0)
    )
    first, *_, last = (sum(touch.force[2] for touch in one.touches) for one in found.instants)
    assert first == 0.0  # on its way
    assert abs(last) == pytest.approx(FORCE, rel=1e-4)


def test_a_medium_for_other_nodes_is_refused(block: Body) -> None:
    with pytest.raises(InputError, match=r"drag wants 8 values, got shape \(3,\)"):
        press(block, NOTHING, [], Loads(drag=np.ones(3)))
