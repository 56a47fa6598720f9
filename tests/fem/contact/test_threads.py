"""Contact of two bodies with friction gives the same bits on one thread and on two, and a second time."""

from __future__ import annotations

import numpy as np

from tests.fem.contact.bodies import named
from warpjld.fem import Body, NeoHooke, box_hexes, merge, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press


def _pressed(threads: int) -> ContactSolution:
    """A block pressed on another and dragged, its mesh turned against the other's."""
    law = NeoHooke(1e5, 0.45)
    lower, upper = box_hexes((1.0, 1.0, 0.4), (6, 6, 3)), box_hexes((0.7, 0.7, 0.4), (5, 4, 3))
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
    upper = type(upper)(upper.nodes @ turn.T, upper.elements, upper.regions, faces=upper.faces)
    mesh = merge(named(lower, "a"), named(upper, "b", (0.25, 0.1, 0.401)))
    body = Body(mesh, {"a": law, "b": law}, threads=threads)
    top = mesh.node_set("b.z+")
    known = prescribe(mesh, "a.z-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, top, x=0.02, y=0.0, z=-0.04)
    return press(body, known, [Pair("b.z-", "a.z+", 0.4)], times=[1.0])


def test_threads_and_repetitions_give_the_same_bits() -> None:
    one, again, two = _pressed(1), _pressed(1), _pressed(2)
    assert one.converged
    assert one.last.touches[0].normal_force > 100.0
    for other in (again, two):
        assert other.last.displacement.tobytes() == one.last.displacement.tobytes()
        assert other.last.reactions.tobytes() == one.last.reactions.tobytes()
        assert [instant.solves for instant in other.instants] == [instant.solves for instant in one.instants]
