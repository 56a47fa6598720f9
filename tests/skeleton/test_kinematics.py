"""Angles to poses: signs, composition and the vertical component of flexion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.skeleton import (
    CHANNELS,
    Skeleton,
    default_limits,
    poses_from_angles,
    poses_from_world,
    rest_poses,
)


def chain(side: str = "right") -> Skeleton:
    """Three joints along -z, dorsal side +y: a finger seen palm down."""
    names = (f"{side}.index.base", f"{side}.index.knuckle2", f"{side}.index.tip")
    return Skeleton(
        names,
        np.array([-1, 0, 1], dtype=np.int32),
        np.array([[0, 0, 0], [0, 0, -0.05], [0, 0, -0.09]], dtype=float),
        np.tile([-1.0, 0.0, 0.0], (3, 1)),
        default_limits(names),
    )


def angles(**channels: float) -> np.ndarray:
    out = np.zeros((1, 3, 4))
    for name, value in channels.items():
        out[0, 0, CHANNELS.index(name)] = np.radians(value)
    return out


def test_flexion_bends_towards_the_palm() -> None:
    tip = poses_from_angles(chain(), angles(flexion=90)).positions[0, 2]
    np.testing.assert_allclose(tip, [0, -0.09, 0], atol=1e-12)


def test_rest_is_the_identity() -> None:
    poses = rest_poses(chain(), 2)
    np.testing.assert_array_equal(poses.rotations, np.tile([0, 0, 0, 1.0], (2, 3, 1)))
    np.testing.assert_array_equal(poses.positions[1], chain().rest)


@pytest.mark.parametrize(("channel", "expected"), [("abduction", 1), ("pivot", 1)])
def test_left_mirrors_right(channel: str, expected: int) -> None:
    both = [
        poses_from_angles(chain(side), angles(flexion=40, **{channel: 20})).positions[0, 2]
        for side in ("right", "left")
    ]
    assert both[0][0] * expected < 0, "a right hand's thumb, palm down, is at -x"
    np.testing.assert_allclose(both[0] * [-1, 1, 1], both[1], atol=1e-12)


@given(flexion=st.floats(-60, 170), pivot=st.floats(-80, 80))
def test_vertical_component_of_a_pivoted_flexion(flexion: float, pivot: float) -> None:
    f, p = np.radians([flexion, pivot])
    got = poses_from_angles(chain(), angles(flexion=flexion, pivot=pivot)).flexion[0, 0]
    assert got == pytest.approx(np.arctan2(np.sin(f) * np.cos(p), np.cos(f)), abs=1e-9)


@given(st.lists(st.floats(-170, 170), min_size=3, max_size=3))
def test_signs_stay_aligned_along_the_tree(values: list[float]) -> None:
    flexions = np.zeros((1, 3, 4))
    flexions[0, :, 0] = np.radians(values)
    rotations = poses_from_angles(chain(), flexions).rotations[0]
    assert (rotations[:-1] * rotations[1:]).sum(-1).min() > 0
    total = Rotation.from_quat(rotations[2]).as_matrix()
    expected = Rotation.from_rotvec([-np.radians(values).sum(), 0, 0]).as_matrix()
    np.testing.assert_allclose(total, expected, atol=1e-12)


def test_bad_angles_are_named() -> None:
    bad = angles(flexion=10)
    bad[0, 1, 0] = np.nan
    with pytest.raises(InputError, match=r"right.index.knuckle2.flexion is not finite at frame 0"):
        poses_from_angles(chain(), bad)


def test_joint_names_may_leave_the_side_out_and_are_suggested() -> None:
    assert chain().index("INDEX.base") == 0
    with pytest.raises(InputError, match=r"did you mean index.knuckle2"):
        chain().index("index.knukle2")


@given(
    st.lists(st.floats(-170, 170), min_size=3, max_size=3),
    st.lists(st.sampled_from([-1.0, 1.0]), min_size=3, max_size=3),
)
def test_world_transforms_of_either_sign_give_the_same_poses(values: list[float], signs: list[float]) -> None:
    flexions = np.zeros((1, 3, 4))
    flexions[0, :, 0] = np.radians(values)
    poses = poses_from_angles(chain(), flexions)
    again = poses_from_world(chain(), poses.positions, poses.rotations * np.array(signs)[:, None])
    np.testing.assert_allclose(again.flexion, poses.flexion, atol=1e-12)
    np.testing.assert_allclose(again.positions, poses.positions, atol=1e-12)
    rotations = again.rotations[0]
    assert (rotations[:-1] * rotations[1:]).sum(-1).min() > -1e-12
    np.testing.assert_allclose(np.abs((rotations * poses.rotations[0]).sum(-1)), 1, atol=1e-12)
