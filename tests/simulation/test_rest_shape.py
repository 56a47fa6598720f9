"""Flesh carried to a pose by the covering."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.covering import Covering
from warpjld.covering.kept import bind_kept
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.hand.flesh_hand import FleshHand, build_flesh_hand
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.simulation.bodies.rest_shape import cut_to_digits, rest_in_pose
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.kinematics import rest_poses


@pytest.fixture(scope="module")
def covering(rig: Rig) -> Covering:
    return bind_kept(rig)[0]


@pytest.fixture(scope="module")
def bent(rig: Rig) -> Poses:
    """Index finger half closed, the hand moved as a whole."""
    angles = np.zeros((1, len(rig.skeleton), 4))
    for joint, degrees in (("base", 40), ("knuckle2", 60), ("knuckle3", 40)):
        angles[0, rig.skeleton.index(f"left.index.{joint}"), 0] = np.radians(degrees)
    return poses_from_angles(rig.skeleton, angles, root_position=np.array([[0.1, 0.2, 0.3]]))


def test_at_rest_nothing_moves(hand: FleshHand, rig: Rig) -> None:
    still, gap = rest_in_pose(hand, rest_poses(rig.skeleton), rig.surface.vertices)
    np.testing.assert_allclose(still.mesh.nodes, hand.mesh.nodes, atol=1e-7)
    assert gap < 1e-7


def test_skin_nodes_lie_on_the_covered_skin_and_bones_stay_rigid(
    hand: FleshHand, covering: Covering, bent: Poses
) -> None:
    skin = covering.deform(bent)[0].astype(np.float64)
    there, gap = rest_in_pose(hand, bent, skin)
    assert there.mesh.scaled_jacobian().min() > 0.02
    assert gap < 1.5e-3
    outer = np.setdiff1d(np.unique(there.mesh.quads(there.skin_faces)), np.concatenate(there.bone_nodes))
    away = np.abs(Facets(skin, hand.surface.faces).project(there.mesh.nodes[outer]).distance)
    assert np.percentile(away, 95) < 1e-4
    for nodes in hand.bone_nodes:
        before, after = hand.mesh.nodes[nodes], there.mesh.nodes[nodes]
        np.testing.assert_allclose(
            np.linalg.norm(after - after[0], axis=1), np.linalg.norm(before - before[0], axis=1), atol=1e-12
        )


def test_a_finger_curled_into_the_palm_is_upright(hand: FleshHand, covering: Covering, rig: Rig) -> None:
    """Its last phalanx has turned by 240° in all."""
    angles = np.zeros((1, len(rig.skeleton), 4))
    for joint, degrees in (("base", 88), ("knuckle2", 98), ("knuckle3", 54)):
        angles[0, rig.skeleton.index(f"left.middle.{joint}"), 0] = np.radians(degrees)
    poses = poses_from_angles(rig.skeleton, angles)
    there, gap = rest_in_pose(hand, poses, covering.deform(poses)[0].astype(np.float64))
    assert there.mesh.scaled_jacobian().min() > 0.05
    assert gap < 3.5e-3


def test_a_part_is_one_digit_and_blends_into_the_covering(hand: FleshHand, covering: Covering, bent: Poses) -> None:
    skin = covering.deform(bent)[0].astype(np.float64)
    there, _ = rest_in_pose(hand, bent, skin)
    part = cut_to_digits(there, bent, skin, ("index",))
    assert len(part.hand.mesh.nodes) < 0.15 * len(hand.mesh.nodes)
    assert len(part.cut)
    assert part.hand.mesh.scaled_jacobian().min() == pytest.approx(there.mesh.scaled_jacobian().min(), abs=0.5)
    elsewhere = skin + 1.0
    still = part.deformed(np.zeros_like(part.hand.mesh.nodes), elsewhere)
    np.testing.assert_allclose(still[part.blend == 0.0], elsewhere[part.blend == 0.0])
    np.testing.assert_allclose(still[part.blend == 1.0], skin[part.blend == 1.0])
    assert (part.blend == 1.0).sum() > 50
    tip = skin[part.blend == 1.0]
    assert np.ptp(tip, axis=0).max() < 0.08
    moved = part.deformed(np.tile([0.0, 0.002, 0.0], (len(part.hand.mesh.nodes), 1)), skin)
    np.testing.assert_allclose((moved - skin)[:, 1], 0.002 * part.blend, atol=1e-6)
    # what drives the whole hand drives the part in the same way
    again = part.start.to(part.hand.moves(bent))
    np.testing.assert_allclose(part.hand.prescribed_by(again).values, 0.0, atol=1e-12)


def test_the_thumb_comes_with_its_ball(hand: FleshHand, rig: Rig) -> None:
    rest = rest_poses(rig.skeleton)
    thumb, palm = (cut_to_digits(hand, rest, rig.surface.vertices, (name,)) for name in ("thumb", "palm"))
    names = np.array(thumb.hand.label_names)
    assert {"left.palm.thumb", "left.thumb.proximal", "left.thumb.distal"} <= set(names[thumb.hand.skin_labels])
    assert not any("index.middle" in name for name in names[thumb.hand.skin_labels])
    assert ((thumb.blend > 0.5) & (palm.blend > 0.5)).sum() > 50
    assert len(thumb.hand.mesh.nodes) < 0.6 * len(palm.hand.mesh.nodes)


def test_a_whole_hand_is_its_own_part(hand: FleshHand, rig: Rig) -> None:
    part = cut_to_digits(hand, rest_poses(rig.skeleton), rig.surface.vertices)
    assert len(part.cut) == 0
    assert (part.blend == 1.0).all()
    assert part.hand is hand


@pytest.mark.slow
def test_bones_that_crush_flesh_between_them_let_it_go(data: Path) -> None:
    """A pinky bent so far that an element has no room between its phalanges: two or three nodes there are flesh's."""
    rig = load_rig(data / "hand_webxr_generic" / "left.glb")
    built = build_flesh_hand(rig, 0.003)
    angles = np.zeros((1, len(rig.skeleton), 4))
    for joint, degrees in (("base", 86), ("knuckle2", 92), ("knuckle3", 75)):
        angles[0, rig.skeleton.index(f"left.pinky.{joint}"), 0] = np.radians(degrees)
    poses = poses_from_angles(rig.skeleton, angles)
    skin = bind_kept(rig)[0].deform(poses)[0].astype(np.float64)
    hand, _ = rest_in_pose(built, poses, skin)
    assert hand.mesh.scaled_jacobian().min() > 0.0
    let_go = [len(before) - len(after) for before, after in zip(built.bone_nodes, hand.bone_nodes, strict=True)]
    assert 0 < sum(let_go) < 10
    assert min(let_go) >= 0
