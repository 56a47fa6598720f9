"""What is left over on an object, told and judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.simulation.report.balance import ObjectBalance
from warpjld.simulation.solve.grasp_balance import weight_of


def balance(net: float, pressing: float, weight: float = 1.0, *, by_hands: bool = True) -> ObjectBalance:
    return ObjectBalance("BOX", 30.0, np.array([net, 0.0, 0.0]), np.zeros(3), pressing, by_hands, weight, True)


def test_a_grasp_that_pushes_is_not_balanced() -> None:
    one = balance(38.0, 61.0)
    assert one.unbalanced
    assert (
        one.text == "on BOX 61 N press, of which 38 N and 0 N m are left over: what holds BOX in its place bears them"
    )


def test_what_lies_in_a_hand_and_is_touched_by_fingers_is_balanced() -> None:
    one = replace(balance(0.6, 0.72, 0.0), lies=True)
    assert replace(one, lies=False).unbalanced
    assert not one.unbalanced
    assert one.text == "on BOX 0.72 N press, and bear its weight"


@pytest.mark.parametrize(
    "one",
    [
        balance(15.0, 61.0),  # friction, or a place that is fixed, hides that
        balance(0.9, 1.5),  # no more than it may weigh
        balance(60.0, 61.0),  # from one side: nobody grasps
        balance(38.0, 61.0, by_hands=False),  # it stands on something
    ],
)
def test_these_are_no_such(one: ObjectBalance) -> None:
    assert not one.unbalanced


def test_what_a_rigid_object_may_weigh() -> None:
    box = trimesh.creation.box((0.05, 0.05, 0.1))
    box.apply_translation((3.0, -2.0, 1.0))
    assert weight_of(RigidMesh(box.vertices, box.faces)) == pytest.approx(0.25 * 9.81)
