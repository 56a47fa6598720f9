"""Joints off the middle of their flesh: told in millimetres, and moved there on request."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from warpjld.geometry.surface import weld_surface
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.own_joints import own_poses
from warpjld.rig import Rig
from warpjld.rig.centres import joint_centres, with_centred_joints
from warpjld.skeleton import Skeleton, default_limits
from warpjld.skeleton.recognise.tree import SourceTree

NAMES = ("left.index.base", "left.index.knuckle2", "left.index.knuckle3", "left.index.tip")
RADIUS, SEGMENT = 0.008, 0.03
AROUND, RINGS = 36, 46


def finger(shift, angle: float = 0.0, turn=(0, 0, 0)) -> Rig:
    """A tube of three segments, bent by ``angle`` at the middle joint, which is shifted across the bisector plane."""
    bend = Rotation.from_rotvec([-angle / 2, 0, 0])
    back = bend.inv()
    knuckle = np.array([0.0, 0.0, -2 * SEGMENT])
    ways = [bend.apply([0, 0, 1.0]), back.apply([0, 0, -1.0])]
    rest = np.array(
        [knuckle + 2 * SEGMENT * ways[0], knuckle + SEGMENT * ways[0], knuckle, knuckle + SEGMENT * ways[1]]
    )
    ring = np.arange(AROUND) * 2 * np.pi / AROUND
    circle = np.column_stack([np.cos(ring), np.sin(ring)]) * RADIUS
    points = []
    for s in np.linspace(-2.2 * SEGMENT, 1.2 * SEGMENT, RINGS):
        place, frame = (knuckle - s * ways[0], bend) if s < 0 else (knuckle + s * ways[1], back)
        points.append(place + frame.apply(np.column_stack([circle, np.zeros(AROUND)])))
    faces = []
    for i in range(RINGS - 1):
        for k in range(AROUND):
            a, b = AROUND * i + k, AROUND * i + (k + 1) % AROUND
            faces += [[a, a + AROUND, b], [b, a + AROUND, b + AROUND]]
    rest[2] += [shift[0], shift[1], 0.0]
    whole = Rotation.from_rotvec(turn)
    rest, surface = whole.apply(rest), weld_surface(whole.apply(np.concatenate(points)), faces)
    parents = np.array([-1, 0, 1, 2], dtype=np.int32)
    skeleton = Skeleton(NAMES, parents, rest, whole.apply(np.tile([-1.0, 0, 0], (4, 1))), default_limits(NAMES))
    frames = np.tile(np.eye(4), (4, 1, 1))
    frames[:, :3, 3] = rest
    source = SourceTree(NAMES, parents.astype(np.int64), frames)
    return Rig("finger", skeleton, surface, source=source, sources=(0, 1, 2, 3), owner=np.arange(4))


def at(rig: Rig, joint: int):
    return next(c for c in joint_centres(rig.skeleton, rig.surface.vertices, rig.surface.faces) if c.joint == joint)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    away=st.floats(0.0, 0.75),
    way=st.floats(0.0, 6.28),
    turn=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
)
def test_a_shifted_joint_is_told_and_moved_back(away: float, way: float, turn) -> None:
    shift = away * RADIUS * np.array([np.cos(way), np.sin(way)])
    rig = finger(shift, turn=turn)
    found = at(rig, 2)
    # the plane tilts a little with the shifted segments, and cuts the tube's middle elsewhere along it
    assert found.distance == pytest.approx(away * RADIUS, rel=0.05, abs=1e-4)
    assert found.thickness == pytest.approx(2 * RADIUS, rel=0.05)
    moved = with_centred_joints(rig)
    place = Rotation.from_rotvec(turn).inv().apply(moved.skeleton.rest[2])
    if found.off:
        assert np.linalg.norm(place[:2]) < 0.03 * RADIUS
        assert not at(moved, 2).off
        assert "mm to the middle" in moved.notes[-1]
    else:
        np.testing.assert_array_equal(moved.skeleton.rest, rig.skeleton.rest)
    np.testing.assert_array_equal(moved.source.frames, rig.source.frames)


@pytest.mark.parametrize("angle", [20.0, 60.0])
def test_a_finger_half_closed_at_rest(angle: float) -> None:
    """The plane halfway cuts a bent tube through its middle, whatever the angle."""
    rig = finger((0.0, 0.0), np.radians(angle))
    assert at(rig, 2).distance < 0.1 * RADIUS
    rig = finger((0.5 * RADIUS, 0.0), np.radians(angle))
    assert at(rig, 2).distance == pytest.approx(0.5 * RADIUS, rel=0.1)


def test_what_is_in_the_middle_is_not_moved() -> None:
    rig = finger((0.1 * RADIUS, 0.0))
    assert not with_centred_joints(rig).notes
    assert with_centred_joints(rig).skeleton.rest.tolist() == rig.skeleton.rest.tolist()


def test_animations_of_the_files_joints_move_the_flesh_as_before() -> None:
    """A moved joint is only another point of the same bone."""
    rig = finger((0.0, 0.7 * RADIUS))
    moved = with_centred_joints(rig)
    assert np.linalg.norm(moved.skeleton.rest[2] - rig.skeleton.rest[2]) > 0.5 * RADIUS
    worlds = np.tile(rig.source.frames, (3, 1, 1, 1))
    for frame, angle in enumerate((0.0, 0.6, 1.2)):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec([-angle, 0, 0]).as_matrix()
        joint = rig.source.frames[2][:3, 3]
        turn[:3, 3] = joint - turn[:3, :3] @ joint
        worlds[frame, 2:] = turn @ rig.source.frames[2:]
    animation = JointAnimation(rig.source, worlds, 30.0)
    poses = [own_poses(animation, r).poses for r in (rig, moved)]
    np.testing.assert_allclose(poses[0].rotations, poses[1].rotations, atol=1e-12)
    # where each bone carries one place of it
    for j in range(4):
        carried = [
            p.positions[:, j]
            + Rotation.from_quat(p.rotations[:, j]).apply(np.array([0, 0, -0.07]) - r.skeleton.rest[j])
            for p, r in zip(poses, (rig, moved), strict=True)
        ]
        np.testing.assert_allclose(*carried, atol=1e-12)


def test_flesh_as_wide_as_its_segments_says_nothing() -> None:
    rig = finger((0.0, 0.0))
    wide = rig.surface.vertices * [3.0, 3.0, 1.0]
    assert joint_centres(rig.skeleton, wide, rig.surface.faces) == ()
