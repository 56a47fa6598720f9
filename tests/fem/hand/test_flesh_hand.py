"""The flesh hand: bones that move rigidly, flesh that follows smoothly, skin that knows its segments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem import Body, solve
from warpjld.fem.hand import FleshHand, build_flesh_hand, hand_laws, motion_of
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.hand import DIGITS


def curled(hand: FleshHand, degrees: float, frames: int = 1, **root) -> Poses:  # type: ignore[no-untyped-def]
    """Fingers bent evenly to these degrees in every joint at the last frame."""
    skeleton = hand.skeleton
    angles = np.zeros((frames, len(skeleton), 4))
    for digit in ("index", "middle", "ring", "pinky"):
        for joint in ("base", "knuckle2", "knuckle3"):
            ramp = np.radians(degrees) * np.arange(1, frames + 1) / frames
            angles[:, skeleton.index(f"{digit}.{joint}"), 0] = ramp
    return poses_from_angles(skeleton, angles, **root)


def test_weights_are_a_partition(hand: FleshHand) -> None:
    np.testing.assert_allclose(hand.weights.sum(axis=1), 1.0, atol=1e-12)
    assert hand.weights.min() >= 0.0
    for bone, nodes in enumerate(hand.bone_nodes):
        assert len(nodes)
        assert (hand.weights[nodes, bone] == 1.0).all()


def test_bones_move_rigidly_with_their_segments(hand: FleshHand) -> None:
    poses = curled(hand, 50.0)
    held = hand.prescribed(poses)
    assert (np.diff(held.degrees) > 0).all()
    u = held.full(3 * len(hand.mesh.nodes)).reshape(-1, 3)
    for nodes, near, far in zip(hand.bone_nodes, hand.flesh.parents, hand.flesh.bones, strict=True):
        x = hand.mesh.nodes[nodes]
        before = np.linalg.norm(x[:, None] - hand.skeleton.rest[[near, far]], axis=2)
        after = np.linalg.norm((x + u[nodes])[:, None] - poses.positions[0, [near, far]], axis=2)
        np.testing.assert_allclose(after, before, atol=1e-12)


def test_guess_is_exact_for_a_hand_moved_as_a_whole(hand: FleshHand) -> None:
    turn = Rotation.from_euler("xyz", [0.4, -0.9, 0.3])
    shift = np.array([[0.1, 0.2, -0.3]])
    poses = curled(hand, 0.0, root_rotation=turn.as_quat()[None], root_position=shift)
    still = hand.moves(hand.rest_pose())
    found = hand.guess(still, hand.moves(poses)) + hand.mesh.nodes
    root = hand.skeleton.rest[0]
    np.testing.assert_allclose(found, turn.apply(hand.mesh.nodes - root) + root + shift, atol=1e-12)
    placed = hand.placed(poses)
    np.testing.assert_allclose(placed.mesh.nodes, found, atol=1e-12)
    np.testing.assert_allclose(placed.prescribed(poses).values, 0.0, atol=1e-12)
    np.testing.assert_allclose(placed.rest_pose().positions, poses.positions, atol=1e-12)
    surface = turn.apply(hand.surface.vertices - root) + root + shift
    np.testing.assert_allclose(placed.skin(), surface, atol=1e-12)


@pytest.mark.slow
def test_a_step_from_the_guess_saves_newton_steps_and_ends_at_the_same_place(coarse: FleshHand) -> None:
    motion = motion_of(coarse, curled(coarse, 10.0))
    body = Body(coarse.mesh, hand_laws(coarse.mesh.region_names))
    plain = solve(body, motion.prescribed(1.0), tolerance=1e-7)
    guess = motion.guess(0.0, 1.0, np.zeros_like(coarse.mesh.nodes))
    fast = solve(body, motion.prescribed(1.0), tolerance=1e-7, guess=guess)
    assert fast.last.newton < plain.last.newton
    assert fast.last.newton <= 4
    np.testing.assert_allclose(fast.displacement, plain.displacement, atol=1e-8)
    assert body.at(fast.displacement, stiffness=False).lowest.min() > 0
    # the guess itself is already near: a small part of how far the fingers move
    assert np.abs(guess - plain.displacement).max() < 0.1 * np.abs(plain.displacement).max()


def test_times_between_frames_keep_bones_rigid(hand: FleshHand) -> None:
    motion = motion_of(hand, curled(hand, 80.0, 2), [0.5, 2.0])
    assert motion.pose(0.0).positions == pytest.approx(hand.skeleton.rest[None])
    pose = motion.pose(1.4)
    half = curled(hand, 40.0 * (1.0 + 0.6))
    np.testing.assert_allclose(pose.positions, half.positions, atol=1e-9)
    np.testing.assert_allclose(pose.flexion, half.flexion, atol=1e-9)
    np.testing.assert_allclose(motion.pose(7.0).positions, motion.pose(2.0).positions)
    u = motion.guess(0.5, 1.4, motion.guess(0.0, 0.5, np.zeros((len(hand.mesh.nodes) + 5, 3))))
    known = motion.prescribed(1.4)
    np.testing.assert_allclose(u.ravel()[known.degrees], known.values)
    assert not u[-5:].any()
    with pytest.raises(InputError, match="want 2 rising times above 0"):
        motion_of(hand, curled(hand, 10.0, 2), [1.0, 1.0])


def test_labels_and_what_never_touches(hand: FleshHand) -> None:
    names = list(hand.label_names)
    middle = hand.mesh.nodes[hand.mesh.quads(hand.skin_faces)].mean(axis=1)
    for joint, name in (("index.tip", "left.index.distal"), ("thumb.tip", "left.thumb.distal")):
        tip = hand.skeleton.rest[hand.skeleton.index(joint)]
        nearest = int(np.argmin(np.linalg.norm(middle - tip, axis=1)))
        assert names[hand.skin_labels[nearest]] == name

    def never(a: str, b: str) -> bool:
        return bool(hand.excluded[names.index(f"left.{a}"), names.index(f"left.{b}")])

    assert never("index.distal", "index.middle")
    assert never("index.middle", "index.proximal")
    assert not never("index.distal", "index.proximal")  # a fingertip comes down on its own first phalanx
    assert never("thumb.distal", "thumb.proximal")
    assert never("palm.index", "index.proximal")
    assert never("index.proximal.web", "middle.proximal.web")
    assert not never("index.distal", "palm.index")
    assert not never("index.distal", "thumb.distal")
    assert not never("index.middle", "middle.middle")
    assert not never("ring.distal", "palm.thumb")
    assert (hand.excluded == hand.excluded.T).all()
    # a fingertip on the border of two labels of the palm is master to both; so are webs of a digit on one side
    digits = [next((part for part in name.split(".")[:-1] if part in DIGITS), "") for name in names]
    assert digits[0] == ""
    assert digits == sorted(digits, key=digits.index)
    labelled = hand.node_labels >= 0
    assert set(np.flatnonzero(labelled)) == set(np.unique(hand.mesh.quads(hand.skin_faces)))
    assert not any(names[k].endswith(".web") for k in np.unique(hand.node_labels[labelled]))


def test_what_cannot_be_is_refused(hand: FleshHand) -> None:
    with pytest.raises(InputError, match="poisson: want"):
        hand_laws(hand.mesh.region_names, poisson=0.5)
    with pytest.raises(InputError, match="poses: want 26 joints, got 1"):
        hand.prescribed(Poses(np.zeros((1, 1, 3)), np.zeros((1, 1, 4)), np.zeros((1, 1))))
    from warpjld.hand.kept import kept_hand

    with pytest.raises(InputError, match="gap, head"):
        build_flesh_hand(kept_hand("left", resolution=2500), gap=0.6)
