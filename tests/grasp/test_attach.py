"""Objects that follow joints: where they are before, during and after (R69–R72, C14)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.grasp import Places
from warpjld.grasp.attach import Association, carried, joint_basis
from warpjld.skeleton import poses_from_angles

NAMES = ("wrist", "index.knuckle2", "thumb.tip", "middle.carpometacarpal", "pinky.base")


def poses_at(skeleton, frames):
    """A hand that bends, moves and turns smoothly over the frames."""
    frames = np.asarray(frames, dtype=float)
    low, high = np.moveaxis(skeleton.limits, -1, 0)
    phase = 0.5 - 0.5 * np.cos(frames / 7.0)
    angles = low + (high - low) * phase[:, None, None] * 0.8
    shift = np.stack([0.01 * frames, 0.02 * np.sin(frames), -0.005 * frames], axis=1)
    turn = Rotation.from_rotvec(np.outer(frames, [0.02, 0.05, -0.03])).as_quat()
    return poses_from_angles(skeleton, angles, root_position=shift, root_rotation=turn)


def basis_of(rig):
    return lambda association, frames: joint_basis(rig.skeleton, poses_at(rig.skeleton, frames), association.joint)


@pytest.mark.parametrize("name", NAMES)
def test_the_basis_is_the_papers(rig, name: str) -> None:
    joint = rig.skeleton.index(name)
    poses = poses_at(rig.skeleton, np.arange(5))
    origin, axes = joint_basis(rig.skeleton, poses, joint)
    np.testing.assert_array_equal(origin, poses.positions[:, joint])
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-12)
    np.testing.assert_allclose(axes[:, :, 2], np.cross(axes[:, :, 0], axes[:, :, 1]), atol=1e-12)
    turned = Rotation.from_quat(poses.rotations[:, joint])
    np.testing.assert_allclose(axes[:, :, 0], turned.apply(rig.skeleton.axes[joint]), atol=1e-12)
    assert ((axes[:, :, 1] * turned.apply(rig.skeleton.directions[joint])).sum(axis=1) > 0.5).all()


@pytest.mark.parametrize("name", NAMES)
def test_initial_place_follows_final_place_without_a_jump(rig, name: str) -> None:
    joint = rig.skeleton.index(name)
    first = Places.of((0.1, -0.2, 0.3), (0.1, 0.2, 0.3, 0.9))
    one = [Association("A", joint, 5.0, 10.0)]
    frames = np.array([0.0, 3.0, 5.0, 5.0 + 1e-7, 7.5, 10.0 - 1e-7, 10.0, 10.0 + 1e-7, 20.0])
    places = carried(first, one, frames, basis_of(rig))
    for k in (0, 1, 2):
        np.testing.assert_allclose(places.position[k], first.position[0], atol=1e-15)
    np.testing.assert_allclose(places.position[3], first.position[0], atol=1e-7)
    np.testing.assert_allclose(places.position[5], places.position[6], atol=1e-7)
    np.testing.assert_allclose(places.position[7:], places.position[[6, 6]], atol=1e-12)
    # in the joint's basis the object stands still while it follows
    origin, axes = joint_basis(rig.skeleton, poses_at(rig.skeleton, frames), joint)
    local = np.einsum("fji,fj->fi", axes, places.position - origin)
    np.testing.assert_allclose(local[[4, 6]], local[[2, 2]], atol=1e-12)
    turn = Rotation.from_matrix(axes).inv() * Rotation.from_quat(places.rotation)
    assert (turn[2].inv() * turn[4]).magnitude() < 1e-12
    assert np.linalg.norm(places.position[4] - places.position[2]) > 1e-3


def test_from_hand_to_hand(rig) -> None:
    wrist, tip = rig.skeleton.index("wrist"), rig.skeleton.index("index.tip")
    first, basis = Places.of((0.1, 0, 0)), basis_of(rig)
    chain = [Association("A", tip, 8.0, 12.0), Association("A", wrist, 2.0, 8.0)]
    both = carried(first, chain, [8.0, 12.0, 15.0], basis)
    then = carried(first, chain[1:], [8.0], basis)
    np.testing.assert_allclose(both.position[0], then.position[0], atol=1e-12)
    np.testing.assert_allclose(both.position[1], carried(then, chain[:1], [12.0], basis).position[0], atol=1e-12)


def test_every_frame_alone_gives_the_same(rig) -> None:
    one = [Association("A", rig.skeleton.index("ring.base"), 1.0, 6.0)]
    frames = np.arange(8.0)
    together = carried(Places.of((0.1, 0, 0)), one, frames, basis_of(rig))
    for k, frame in enumerate(frames):
        alone = carried(Places.of((0.1, 0, 0)), one, [frame], basis_of(rig))
        np.testing.assert_allclose(alone.position[0], together.position[k], atol=1e-14)


def test_what_makes_no_sense_is_refused(rig) -> None:
    with pytest.raises(InputError, match="two joints at once"):
        carried(Places.of(), [Association("A", 1, 0, 5), Association("A", 2, 4, 9)], [1.0], basis_of(rig))
    with pytest.raises(InputError, match="cannot stop"):
        carried(Places.of(), [Association("A", 1, 6, 5)], [1.0], basis_of(rig))
