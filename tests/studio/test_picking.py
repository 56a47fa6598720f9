"""A click on the skin selects the joint that moves it there."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.studio.document import ScriptDocument
from warpjld.studio.picking import digit_of, first_hit, joint_at
from warpjld.studio.state import StudioState
from warpjld.studio.surfaces import Shown


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> StudioState:
    folder = tmp_path_factory.mktemp("studio")
    text = "HAND LEFT BUILTIN RESOLUTION 1500\nMOVE LEFT 0 0.1 0.2 0.3\n"
    return StudioState(ScriptDocument(folder / "a.jld", text), folder / "out")


@pytest.mark.parametrize("joint", ["left.index.base", "left.index.knuckle3", "left.thumb.knuckle2", "left.pinky.base"])
def test_the_joint_of_the_bone_under_the_pointer(state: StudioState, joint: str) -> None:
    (hand,) = state.shown()
    assert state.actor is not None
    names = state.actor.skeleton.names
    start = names.index(joint)
    (end,) = [j for j, parent in enumerate(state.actor.skeleton.parents) if parent == start]
    assert hand.joints is not None
    middle = (hand.joints[start] + hand.joints[end]) / 2.0
    for way in (np.array([0.1, 1.0, 0.2]), np.array([-0.2, -1.0, 0.1])):
        hit = first_hit([hand], middle - 0.5 * way, way)
        assert hit is not None
        assert hit[0] is hand
        assert np.linalg.norm(hand.vertices[hit[1]] - middle) < 0.03
        assert joint_at(state.actor, hit[1]) == joint
    assert digit_of(joint) == joint.split(".")[1]


def test_the_nearer_surface_is_hit_and_a_ray_that_misses_hits_none() -> None:
    places = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    far, near = Shown("FAR", places, faces), Shown("NEAR", places + np.float32([0, 0, 1]), faces)
    hit = first_hit([far, near], (0.1, 0.7, 5.0), (0.0, 0.0, -2.0))
    assert hit is not None
    assert (hit[0].name, hit[1]) == ("NEAR", 2)
    assert first_hit([far, near], (2.0, 2.0, 5.0), (0.0, 0.0, -1.0)) is None
    assert first_hit([far, near], (0.1, 0.7, 5.0), (0.0, 0.0, 1.0)) is None  # it lies behind
    assert digit_of("left.wrist") is None
