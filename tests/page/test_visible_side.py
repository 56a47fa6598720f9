"""Of which surfaces only the outside is drawn."""

from __future__ import annotations

import numpy as np
import trimesh

from warpjld.page.visible_side import visible_side

BALL = trimesh.creation.icosphere(subdivisions=2)
PLACES, FACES = BALL.vertices.astype(np.float32) + np.float32([3, 0, 0]), BALL.faces.astype(np.int32)


def test_only_closed_surfaces_that_are_wound_outwards_hide_their_inside() -> None:
    assert visible_side(PLACES, FACES) == "front"
    assert visible_side(PLACES, FACES[:, ::-1]) == "double"  # inside out
    assert visible_side(PLACES, FACES[1:]) == "double"  # a hole
    mixed = FACES.copy()
    mixed[0] = mixed[0, ::-1]
    assert visible_side(PLACES, mixed) == "double"
    assert visible_side(PLACES, np.concatenate([FACES, FACES[:1]])) == "double"  # a triangle twice
    assert visible_side(PLACES, FACES[:0]) == "double"
