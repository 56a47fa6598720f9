"""Blended motions of bones."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.fem.hand.blend import Moves


def chain(turns: list[float]) -> Moves:
    """Bones along x, each turned about z by so many degrees in all, joined at x = 1, 2, …"""
    shifts, at = [], np.zeros(3)
    for k, degrees in enumerate(turns):
        turn = Rotation.from_euler("z", degrees, degrees=True)
        if k:
            before = Rotation.from_euler("z", turns[k - 1], degrees=True)
            at = before.apply([k, 0, 0]) + shifts[-1]
        shifts.append(at - turn.apply([k, 0, 0]))
    quaternions = Rotation.from_rotvec(np.outer(turns, [0.0, 0.0, 1.0]), degrees=True).as_quat()
    return Moves(quaternions, np.array(shifts))


def test_a_chain_that_curls_by_more_than_half_a_circle_bends_the_short_way_at_every_joint() -> None:
    """At each joint the blend turns by the mean of its two bones, also where one bone has turned by 170° and the next
    by 240°."""
    turns = [0.0, 85.0, 170.0, 240.0]
    moves = chain(turns)
    weights = np.zeros((6, 4))
    for joint in (1, 2, 3):
        weights[2 * joint - 2 : 2 * joint, joint - 1 : joint + 1] = 0.5
    points = np.array([[x, y, 0.0] for x in (1.0, 2.0, 3.0) for y in (0.0, 0.01)])
    moved = moves.blended(weights, points)
    along = moved[1::2] - moved[::2]
    angles = np.degrees(np.unwrap(np.arctan2(along[:, 1], along[:, 0]))) - 90.0
    np.testing.assert_allclose(angles, [42.5, 127.5, 205.0], atol=1e-6)


def test_bones_that_share_nothing_move_rigidly() -> None:
    moves = chain([0.0, 120.0, 200.0])
    points = np.random.default_rng(3).normal(size=(9, 3))
    bone = np.arange(9) % 3
    np.testing.assert_allclose(moves.blended(np.eye(3)[bone], points), moves.of(bone, points), atol=1e-12)
