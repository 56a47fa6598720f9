"""How far steps go."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.fem import Body, NeoHooke, box_hexes
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.line_search import length_upright


@pytest.mark.parametrize(
    ("squeezed", "length"),
    [(0.7, 1.0), (0.9, 0.5), (1.5, 0.5), (2.0, 0.25)],
)
def test_no_step_flattens_elements_to_less_than_a_fifth(squeezed: float, length: float) -> None:
    """A block of height 1 whose upper side comes down by so much."""
    body = Body(box_hexes((1.0, 1.0, 1.0), (2, 2, 1)), NeoHooke(1e5, 0.4))
    elastic = Elastic(body)
    start = np.zeros(body.degrees)
    move = np.zeros_like(body.mesh.nodes)
    move[body.mesh.nodes[:, 2] > 0.5, 2] = -squeezed
    assert length_upright(elastic, start, move.reshape(-1), elastic.forces(start).lowest) == length
