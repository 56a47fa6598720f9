"""Where an object that nothing holds is expected when hands close on it: where it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.script import Scene
from warpjld.script.contact import SceneAnimation
from warpjld.simulation.bodies.deformable_body import History, Surroundings
from warpjld.simulation.bodies.object_body import build_object_body

BALL = "OBJECT ball BALL 0.02 AT 0 0 0\nPHYSICAL ball ELEMENT 0.005\n"


def test_it_is_where_it_was_or_goes_along_with_the_hand_that_holds_it(run: Callable[[str], Scene]) -> None:
    """Put where it overlaps hands least, as without friction, it was taken out of grips that could have held it."""
    scene = run(BALL)
    body = build_object_body(SceneAnimation(scene).objects["BALL"], scene.contact, 0.0)
    moved = np.full_like(body.mesh.nodes, 1e-3)
    np.testing.assert_array_equal(body.guess(0.0, 1.0, moved, Surroundings(None, History())), moved)
    along = Surroundings(lambda points: points + 0.5, History())
    np.testing.assert_allclose(body.guess(0.0, 1.0, moved, along), moved + 0.5)
