"""The skin of the real hand against itself: thumb and index pinch (R126, R127)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import Body
from warpjld.fem.contact import Exclusion, Pair, press
from warpjld.fem.hand import build_flesh_hand, hand_laws
from warpjld.hand import build_hand
from warpjld.press.bodies import HandBody
from warpjld.press.rest import part_of
from warpjld.skeleton import CHANNELS, Skeleton, poses_from_angles

pytestmark = pytest.mark.slow

PINCH = {
    "index.base": {"flexion": 42.6},
    "index.knuckle2": {"flexion": 55.9},
    "index.knuckle3": {"flexion": 32.1},
    "thumb.base": {"flexion": 15.0, "pivot": 6.2},
    "thumb.knuckle2": {"flexion": 31.9},
    "thumb.knuckle3": {"flexion": 25.9},
}
"""Degrees at which the two last phalanges' bones lie 12.5 mm apart."""


def pinched(skeleton: Skeleton, share: float) -> NDArray[np.float64]:
    angles = np.zeros((1, len(skeleton), 4))
    for joint, channels in PINCH.items():
        for channel, degrees in channels.items():
            angles[0, skeleton.index(joint), CHANNELS.index(channel)] = share * np.radians(degrees)
    return angles


def test_thumb_and_index_pinch() -> None:
    rig = build_hand("left", resolution=4000)
    skeleton = rig.skeleton
    whole = build_flesh_hand(rig)
    part = part_of(whole, whole.rest_pose(), rig.surface.vertices, ("index", "thumb"))
    hand = part.hand
    laws = hand_laws(hand.mesh.region_names)

    def moves(share: float):  # type: ignore[no-untyped-def]
        return whole.moves(poses_from_angles(skeleton, pinched(skeleton, share)))

    driven = HandBody("hand", part, laws, moves, 80e3, True)
    found = press(
        Body(hand.mesh, laws),
        driven.prescribed,
        [Pair("hand", "hand", exclusion=Exclusion(*hand.self_contact()), name="itself")],
        times=[0.3, 0.6, 0.8, 0.88, 0.9, 0.91, 0.92, 0.93, 0.94, 0.95],
        guess=driven.guess,
        tolerance=1e-4,
    )
    touches = [instant.touches[0] for instant in found.instants]
    # bent joints bring the parts of a digit together: those never meet, so nothing touches before the digits do
    assert not any(touch.normal_force for touch in touches[:5])
    forces = [touch.normal_force for touch in touches[5:]]
    assert (np.diff(forces) > 0.0).all()
    assert 0.5 < forces[-1] < 2.0
    names = np.array(hand.label_names)
    for touch in touches[5:]:
        np.testing.assert_allclose(touch.nodal.sum(axis=0), 0.0, atol=1e-9 * touch.normal_force)
        pushed = np.flatnonzero(touch.nodal.any(axis=1))
        digits = names[hand.node_labels[pushed]]
        assert {name.split(".")[1] for name in digits} == {"index", "thumb"}
        assert touch.penetration < 1e-3 * 0.003
    index = np.char.startswith(names[hand.node_labels], "left.index") & (hand.node_labels >= 0)
    assert np.linalg.norm(touches[-1].nodal[index].sum(axis=0)) == pytest.approx(forces[-1], rel=0.1)
