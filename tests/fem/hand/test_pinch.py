"""The skin of the real hand against itself: pinch, finger in the palm, fingers side by side (R126, R127)."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.covering import bind
from warpjld.fem import Body
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.hand import FleshHand, hand_laws
from warpjld.hand.kept import kept_hand
from warpjld.simulation.bodies.flesh_body import BoneMotion, flesh_body
from warpjld.simulation.bodies.rest_shape import cut_to_digits, rest_in_pose
from warpjld.simulation.bodies.skin_parts import skin_parts
from warpjld.simulation.specification import FleshMaterial
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles

pytestmark = pytest.mark.slow

Angles = dict[str, dict[str, float]]

OPEN: Angles = {}
PINCH: Angles = {
    "index.base": {"flexion": 42.6},
    "index.knuckle2": {"flexion": 55.9},
    "index.knuckle3": {"flexion": 32.1},
    "thumb.base": {"flexion": 15.0, "pivot": 6.2},
    "thumb.knuckle2": {"flexion": 31.9},
    "thumb.knuckle3": {"flexion": 25.9},
}
"""Degrees at which the two last phalanges' bones lie 7 mm apart."""
BENT: Angles = {"middle.base": {"flexion": 60}, "middle.knuckle2": {"flexion": 60}, "middle.knuckle3": {"flexion": 30}}
CURLED: Angles = {
    "middle.base": {"flexion": 90},
    "middle.knuckle2": {"flexion": 88},
    "middle.knuckle3": {"flexion": 55},
}
TOGETHER: Angles = {"index.base": {"abduction": -14}, "middle.base": {"abduction": 8}}
EDGE = 0.003


class Hand:
    """Some digits of the built-in hand on their way from one posture, where they rest, to another."""

    def __init__(self, whole: FleshHand, digits: Sequence[str], start: Angles, end: Angles) -> None:
        skeleton = whole.skeleton

        def poses(share: float) -> Poses:
            return poses_from_angles(skeleton, between(skeleton, start, end, share))

        surface = kept_hand("left", resolution=4000).surface
        skin = bind(skeleton, surface).deform(poses(0.0))[0].astype(np.float64)
        hand, _ = rest_in_pose(whole, poses(0.0), skin)
        part = cut_to_digits(hand, poses(0.0), skin, digits)
        self.hand = part.hand
        self.laws = hand_laws(self.hand.mesh.region_names)
        bones = BoneMotion(hand, SimpleNamespace(pose=poses), 0.0)  # type: ignore[arg-type]
        self.driven = flesh_body("hand", part, self.laws, FleshMaterial(), bones, skin_parts(whole))

    def pressed(self, times: Sequence[float], friction: float = 0.0) -> ContactSolution:
        pair = Pair("hand", "hand", friction, exclusion=self.hand.self_contact(), name="itself")
        body = Body(self.hand.mesh, self.laws)
        return press(body, self.driven.prescribed, [pair], times=times, guess=self.driven.guess, tolerance=1e-4)

    def check(self, found: ContactSolution, parts: set[str]) -> NDArray[np.float64]:
        """Resultants on the slave at each instant; action and reaction, overlap, and who touches."""
        names = np.array(self.hand.label_names)
        out = []
        for instant in found.instants:
            touch = instant.touches[0]
            out.append(float(np.linalg.norm(touch.force)))
            if not touch.normal_force:
                continue
            np.testing.assert_allclose(touch.nodal.sum(axis=0), 0.0, atol=1e-9 * touch.normal_force)
            pushed = np.flatnonzero(touch.nodal.any(axis=1))
            labels = names[self.hand.node_labels[pushed]]
            assert {name.removesuffix(".web").split(".")[1] for name in labels} <= parts
            assert touch.penetration < 1e-3 * EDGE
        return np.array(out)


def between(skeleton: Skeleton, start: Angles, end: Angles, share: float) -> NDArray[np.float64]:
    angles = np.zeros((1, len(skeleton), 4))
    for weight, posture in ((1.0 - share, start), (share, end)):
        for joint, channels in posture.items():
            for channel, degrees in channels.items():
                angles[0, skeleton.index(joint), CHANNELS.index(channel)] += weight * np.radians(degrees)
    return angles


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_thumb_and_index_pinch(hand: FleshHand, friction: float) -> None:
    """Steps of about 0.7 mm between the bones."""
    pinch = Hand(hand, ("index", "thumb"), OPEN, PINCH)
    found = pinch.pressed([0.3, 0.6, 0.8, 0.88, *np.arange(0.90, 1.01, 0.01)], friction)
    forces = pinch.check(found, {"index", "thumb"})
    # bent joints bring the parts of a digit together: those never meet, so nothing touches before the digits do
    assert not forces[:5].any()
    assert (np.diff(forces[5:]) > 0.0).all()
    assert 0.5 < forces[9] < 2.0
    assert forces[-1] > 6.0
    cut = 1 if friction else 0  # a step in which friction begins to act ends at first touch
    assert len(found.steps) <= len(found.instants) + cut  # none was halved
    assert np.median(found.steps[5:]) <= 7
    last = found.last.touches[0]
    names = np.array(pinch.hand.label_names)
    index = np.char.startswith(names[pinch.hand.node_labels], "left.index") & (pinch.hand.node_labels >= 0)
    assert np.linalg.norm(last.nodal[index].sum(axis=0)) == pytest.approx(forces[-1], rel=1e-6)
    assert 1.5e-4 < last.contact_area < 3.5e-4  # pads flattened: 14 to 21 mm across


def test_middle_finger_in_the_palm(hand: FleshHand) -> None:
    """Steps of about 2 mm at the fingertip."""
    curled = Hand(hand, ("middle", "palm"), BENT, CURLED)
    found = curled.pressed([0.2, 0.4, 0.6, 0.8, *np.arange(0.88, 1.46, 0.03)])
    forces = curled.check(found, {"middle", "palm"})
    touching = forces[forces > 0.05]
    assert (np.diff(touching) > 0.0).all()
    assert forces[-1] > 5.0
    assert np.median(found.steps) <= 7


def test_index_and_middle_finger_side_by_side(hand: FleshHand) -> None:
    """Steps of half a degree each; where the fingers part, at rest, they never meet. Without friction their sides slip
    past one another at 1.4 N."""
    beside = Hand(hand, ("index", "middle"), OPEN, TOGETHER)
    found = beside.pressed([0.2, 0.4, *np.arange(0.42, 0.621, 0.02)], friction=0.6)
    forces = beside.check(found, {"index", "middle"})
    assert (np.diff(forces[forces > 0.0]) > 0.0).all()
    assert forces[-1] > 8.0
    assert np.median(found.steps) <= 8
