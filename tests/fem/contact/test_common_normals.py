"""Normals of contact points between meshes: those of the side that knows them better."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.fem.contact.bodies import named
from warpjld.fem import ball_hexes, box_hexes, merge
from warpjld.fem.contact import Pair
from warpjld.fem.contact.interface.contact_interface import Interface

APART = 0.02


def near(slave: str, master: str, flat: bool) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals from the ball outwards, and positions along the table, of points of a ball of radius 1 that lies
    ``APART`` above a table, or above an equal ball."""
    ball = ball_hexes(1.0, n=6)
    ball = replace(ball, faces={"outer": ball.boundary()})
    upper = named(ball, "ball", (0.013, -0.021, 1.0 + APART))
    if flat:
        below = named(box_hexes((2.0, 2.0, 0.3), (9, 9, 2)), "table", (-1.0, -1.0, -0.3))
    else:
        below = named(ball, "table", (0.013, -0.021, -1.0))
    mesh = merge(upper, below)
    points = Interface(mesh, Pair(slave, master), 1).points(mesh.nodes, 0.0, 0.0)
    sign = -1.0 if slave.startswith("table") else 1.0
    place = mesh.nodes[np.unique(mesh.quads(mesh.face_set(slave)))][points.sites] - [0.013, -0.021, 0.0]
    return sign * points.normal, np.linalg.norm(place[:, :2], axis=1)


@pytest.mark.parametrize(("slave", "master"), [("ball.outer", "table.z+"), ("table.z+", "ball.outer")])
def test_a_flat_side_gives_the_normal_whichever_is_the_slave(slave: str, master: str) -> None:
    """Faces of the ball turn by up to 25° within half a radius, of which those of the table know nothing."""
    normal, away = near(slave, master, flat=True)
    chosen = normal[away < 0.5]
    assert len(chosen) > 4
    tilt = np.degrees(np.arccos(np.clip(-chosen[:, 2], -1.0, 1.0)))
    assert tilt.max() < 3.0


def test_equal_sides_meet_in_the_middle() -> None:
    normal, away = near("ball.outer", "table.outer", flat=False)
    chosen = normal[away < 0.5]
    assert len(chosen) > 4
    tilt = np.degrees(np.arccos(np.clip(-chosen[:, 2], -1.0, 1.0)))
    assert tilt.max() < 1.0
