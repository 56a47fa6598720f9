"""Edits are laid over an animation and returned: nothing that is iterated over changes, and what follows goes along."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.shapes import ball
from warpjld.rig import Rig
from warpjld.script import Scene
from warpjld.script.contact import SceneAnimation, write_keys
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
from warpjld.skeleton import CHANNELS

FLEXION = CHANNELS.index("flexion")


def test_edits_are_laid_over_copies_of_actors(run: Callable[[str], Scene]) -> None:
    scene = run("FINGER1 LEFT INDEX FLEXION AT 0 0\nFINGER1 LEFT INDEX FLEXION AT 10 40\n")
    before = SceneAnimation(scene)
    joint = scene.actor().skeleton.index("left.index.base")
    edit = AngleEdit("LEFT", joint, 6.0, 7.0, 0.2)
    after = before.edited([edit])
    kept = [before.actors["LEFT"].angles(frame)[joint, FLEXION] for frame in range(7)]
    np.testing.assert_array_equal([after.actors["LEFT"].angles(frame)[joint, FLEXION] for frame in range(7)], kept)
    assert after.actors["LEFT"].angles(7.0)[joint, FLEXION] == 0.2
    assert before.actors["LEFT"].angles(7.0)[joint, FLEXION] > 0.4
    assert len(scene.actor().motion.tracks["left.index.base.flexion"].keys) == 2
    write_keys(scene.actor(), edit)
    for frame in (3.5, 7.0, 8.5, 10.0):
        np.testing.assert_array_equal(
            SceneAnimation(scene).actors["LEFT"].angles(frame), after.actors["LEFT"].angles(frame)
        )


def test_joints_without_keys_are_edited(run: Callable[[str], Scene]) -> None:
    """A correction of a digit of which only the base has keys ended in a KeyError."""
    scene = run("FINGER1 LEFT INDEX FLEXION AT 0 0\nFINGER1 LEFT INDEX FLEXION AT 10 40\n")
    joint = scene.actor().skeleton.index("left.index.knuckle2")
    after = SceneAnimation(scene).edited([AngleEdit("LEFT", joint, 6.0, 7.0, 0.2)]).actors["LEFT"]
    found = [float(after.angles(frame)[joint, FLEXION]) for frame in (0.0, 6.0, 7.0)]
    assert found == pytest.approx([0.0, 0.0, 0.2], abs=1e-9)
    same = SceneAnimation(scene).edited([AngleEdit("LEFT", joint, 6.0, None, 0.2)]).actors["LEFT"]
    assert float(same.angles(9.0)[joint, FLEXION]) == 0.0  # nothing follows that could be replaced


def test_what_follows_an_edited_joint_goes_along(run: Callable[[str], Scene]) -> None:
    scene = run(
        "FINGER1 LEFT INDEX FLEXION AT 0 0\nFINGER1 LEFT INDEX FLEXION AT 10 40\n"
        "OBJECT ring BALL 0.01 AT 0.03 0 -0.16\nOBJECT moon BALL 0.02 AT 1 0 0\n"
    )
    from warpjld.grasp.attach import Association

    scene.prop("ring").associations.append(
        Association("LEFT", scene.actor().skeleton.index("left.index.knuckle2"), 0.0, 20.0)
    )
    before = SceneAnimation(scene)
    joint = scene.actor().skeleton.index("left.index.base")
    after = before.edited([AngleEdit("LEFT", joint, 6.0, 7.0, 0.2)])
    assert after.objects["MOON"] is before.objects["MOON"]
    place, was = after.objects["RING"].place(7.0).position[0], before.objects["RING"].place(7.0).position[0]
    assert np.linalg.norm(place - was) > 1e-3
    np.testing.assert_array_equal(after.objects["RING"].place(5.0).position, before.objects["RING"].place(5.0).position)
    np.testing.assert_allclose(after.objects["RING"].obstacle(2.0).mesh(5.0)[0].mean(axis=0), place, atol=1e-9)


def test_arrays_are_an_animation(rig: Rig) -> None:
    angles = np.zeros((3, len(rig.skeleton), 4))
    joint = rig.skeleton.index("left.index.base")
    angles[1:, joint, FLEXION] = 0.3
    hand = RecordedActor("hand", rig, angles=angles, first=10.0)
    moon = RecordedObject("moon", ball(0.02), positions=[(0, 0, 0), (0, 1, 0)], first=10.0)
    animation = RecordedAnimation([hand], [moon])
    assert animation.actors["hand"].angles(10.5)[joint, FLEXION] == pytest.approx(0.15)
    np.testing.assert_allclose(animation.objects["moon"].place(10.25).position, [[0, 0.25, 0]])
    np.testing.assert_allclose(animation.objects["moon"].place(99.0).position, [[0, 1, 0]])
    held = animation.edited([AngleEdit("hand", joint, 11.0, None, 0.5)])
    assert held.objects["moon"] is animation.objects["moon"]
    assert held.actors["hand"].angles(12.0)[joint, FLEXION] == 0.5
    assert held.actors["hand"].angles(11.0)[joint, FLEXION] == 0.3
    assert hand.angles(12.0)[joint, FLEXION] == 0.3
    poses = hand.pose(11.0)
    given = RecordedActor("hand", rig, poses=poses, covering=hand.covering)
    assert not given.bendable
    np.testing.assert_array_equal(given.skin(0.0), hand.skin(11.0))


def test_arrays_that_do_not_fit_are_refused_by_name(rig: Rig) -> None:
    with pytest.raises(InputError, match="poses, angles: want exactly one of the two"):
        RecordedActor("hand", rig)
    with pytest.raises(InputError, match=r"angles: want finite ones of shape \(F, \d+, 4\), got \(3, 2\)"):
        RecordedActor("hand", rig, angles=np.zeros((3, 2)))
    with pytest.raises(InputError, match=r"root: want finite displacements \(3,\) or \(1, 3\), got \(2, 3\)"):
        RecordedActor("hand", rig, angles=np.zeros((1, len(rig.skeleton), 4)), root=np.zeros((2, 3)))
    with pytest.raises(InputError, match="want a name of its own"):
        RecordedAnimation(objects=[RecordedObject("a", ball(0.02)), RecordedObject("a", ball(0.03))])
