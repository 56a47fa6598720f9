"""Correction and suggestion with real contact: a fingertip pressed on a plate by its finger's knuckles (R119, R120)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import Body, Prescribed, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.hand import hand_laws
from warpjld.fem.hand.blend import Moves, moves_of
from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.fingertip import Fingertip, build_fingertip
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.fem.hand.suggestions import suggestions
from warpjld.hand import build_hand
from warpjld.simulation.grip.correct import Correction, correct_angles
from warpjld.skeleton import Skeleton, poses_from_angles

JOINTS = ("index.base", "index.knuckle2", "index.knuckle3")
LIMITS = {"index": 5.0}


class PressedFinger:
    """An index fingertip whose bone follows its joints, over a plate that it just touches at rest."""

    def __init__(self, skeleton: Skeleton, tip: Fingertip) -> None:
        self.skeleton = skeleton
        self.near, self.far = skeleton.index("index.knuckle3"), skeleton.index("index.tip")
        self.body = Body(tip.mesh, hand_laws(tip.mesh.region_names))
        out = tip.facing(np.radians(25.0))
        first = tip.mesh.nodes[int(np.argmax(tip.mesh.nodes @ out))]
        self.out = out
        self.pair = Pair("tip", Plane(first, -out), name="plate")
        self.solves = 0

    def angles(self, degrees: float) -> NDArray[np.float64]:
        """The base flexed by these degrees, the other joints straight, shape (J, 4)."""
        angles = np.zeros((len(self.skeleton), 4))
        angles[self.skeleton.index("index.base"), 0] = np.radians(degrees)
        return angles

    def move(self, angles: NDArray[np.float64]) -> Moves:
        return moves_of(poses_from_angles(self.skeleton, angles[None]), 0, [self.near], self.skeleton.rest)

    def prescribed(self, angles: NDArray[np.float64]) -> Prescribed:
        nodes = self.body.mesh.node_set("held")
        x = self.body.mesh.nodes[nodes]
        moved = self.move(angles).of(np.zeros(len(nodes), np.int64), x)
        return prescribe(self.body.mesh, nodes, displacement=moved - x)

    def effort(self, angles: NDArray[np.float64]) -> Effort | None:
        """Close from rest, where the skin just touches."""
        self.solves += 1
        solution = press(
            self.body, lambda share: self.prescribed(share * angles), [self.pair], times=(0.5, 1.0), check=False
        )
        if not solution.converged:
            return None
        # its one bone moves as a whole: the flesh alone takes nothing
        held = -solution.last.reactions
        x = self.body.mesh.nodes + solution.last.displacement
        loads = BoneLoads((self.far,), held.sum(axis=0)[None], np.cross(x, held).sum(axis=0)[None])
        return effort_of(self.skeleton, poses_from_angles(self.skeleton, angles[None]), loads, 0, LIMITS)


@pytest.fixture(scope="module")
def finger() -> PressedFinger:
    rig = build_hand("left")
    return PressedFinger(rig.skeleton, build_fingertip(rig, "index", 0.002))


def test_the_finger_is_opened_until_the_plate_pushes_as_hard_as_it_may(finger: PressedFinger) -> None:
    wanted, opened = finger.angles(1.6), finger.angles(0.0)
    first = finger.effort(wanted)
    assert first is not None
    assert first["index"].share > 1.3
    finger.solves = 0
    found = correct_angles(finger.effort, finger.skeleton, wanted, opened)
    assert found.status is Correction.CORRECTED
    assert found.effort is not None
    assert 0.95 <= found.effort["index"].share <= 1.0
    assert found.solves == finger.solves <= 8
    (by,) = found.opened.values()
    assert by[0] > 0.0
    assert not by[1:].any()


def test_the_suggested_opening_lowers_the_force_as_far_as_said(finger: PressedFinger) -> None:
    before, now = finger.angles(1.4), finger.angles(1.6)
    first, second = finger.effort(before), finger.effort(now)
    assert first is not None
    assert second is not None
    (only,) = suggestions(finger.skeleton, second, now, first, before, aim=0.8)
    assert f"open {only.joint} by" in only.text
    assert "for" in only.text
    assert " N of 5 N" in only.text
    opened = now.copy()
    opened[finger.skeleton.index("index." + only.joint.replace(" ", "")), 0] -= only.opening
    after = finger.effort(opened)
    assert after is not None
    assert after["index"].force == pytest.approx(only.wanted, rel=0.25)
