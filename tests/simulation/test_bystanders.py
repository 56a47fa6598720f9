"""Actors without flesh: they press, and are not ignored (R126)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.hand.kept import kept_hand
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation, run_contact
from warpjld.simulation.bodies.skin_obstacle import SkinObstacle, bystanders


def two_hands(lines: str) -> Scene:
    """A left hand whose index comes down on the back of a right one."""
    left, right = kept_hand("left", resolution=2500), kept_hand("right", resolution=2500)
    skin, tip = left.surface.vertices, left.skeleton.rest[left.skeleton.index("left.index.tip")]
    near = skin[np.linalg.norm(skin - tip, axis=1) < 0.02]
    pad = near[near[:, 1].argmin()]
    back, base = right.surface.vertices, right.skeleton.rest[right.skeleton.index("right.middle.base")]
    over = back[np.linalg.norm(back[:, [0, 2]] - base[[0, 2]] - [0.0, 0.02], axis=1) < 0.008]
    x, y, z = pad - over[over[:, 1].argmax()]
    scene = Scene(say=lambda text: None)
    scene.add("left", left)
    scene.add("other", right)
    Interpreter(scene).run_text(
        f"ACTOR LEFT\nMOVE OTHER 0 {x:.5f} {y - 0.001:.5f} {z:.5f}\nMOVE LEFT 0 0 0 0\nMOVE LEFT 2 0 -0.002 0\n{lines}"
    )
    return scene


def test_skin_is_an_obstacle_that_moves_with_its_actor() -> None:
    animation = SceneAnimation(two_hands(""))
    obstacle = SkinObstacle(animation.actors["LEFT"], 0.0)
    skin = animation.actors["LEFT"].skin(0.0)
    some = skin[::50]
    assert np.abs(obstacle.project(some, 0.0).distance).max() < 1e-6
    assert obstacle.carried(some, 0.0, 2.0) - some == pytest.approx(
        np.tile([0.0, -0.002, 0.0], (len(some), 1)), abs=1e-5
    )
    assert obstacle.project(some + np.array([0.0, 1.0, 0.0]), 1.0).distance.min() > 0.5


def test_only_actors_that_may_come_near_are_looked_at() -> None:
    near, far = SceneAnimation(two_hands("")), SceneAnimation(two_hands("MOVE OTHER 0 1 0 0\n"))
    frames = [0.0, 2.0]
    assert list(bystanders(dict(near.actors), {"LEFT"}, frames, False, 0.0)) == ["OTHER"]
    assert not bystanders(dict(far.actors), {"LEFT"}, frames, False, 0.0)
    assert list(bystanders(dict(far.actors), {"LEFT"}, frames, True, 0.0)) == ["OTHER"]  # free objects go anywhere


@pytest.mark.slow
def test_a_hand_without_flesh_is_pressed_on() -> None:
    scene = two_hands("FLESH LEFT INDEX ELEMENT 0.004\nFRAMES 0 2\nPRESS 0 2 EVERY 2\n")
    found = run_contact(scene, Path())
    assert found.verdict.status == "CONVERGED"
    row = next(row for row in found.rows if row.digit == "index" and row.frame == 2.0)
    assert row.against == "OTHER"
    assert row.force_n > 0.02
    assert row.fy_n > 0.9 * row.force_n
