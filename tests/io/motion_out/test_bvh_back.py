"""BVH of a rig's own skeleton: what was written comes back, whatever unit, axes and hierarchy it was written in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.io import load_rig
from warpjld.io.motion_out import write_motion
from warpjld.motion import open_motion
from warpjld.motion.bvh import read_bvh
from warpjld.motion.own_capture import own_capture
from warpjld.rig import Rig
from warpjld.skeleton import Poses, poses_from_rotations

PLACE, TURN = 1e-5, 1e-5
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@pytest.fixture
def rig(write_glb: Callable[..., Path], hand_glb: Callable[..., object], tmp_path: Path) -> Rig:
    return load_rig(write_glb(hand_glb(), tmp_path / "hand.glb"))


def turning(rig: Rig, frames: int = 6) -> Poses:
    draw = np.random.default_rng(4)
    ends = draw.normal(0.0, 0.5, (len(rig.skeleton), 3))
    local = np.stack([Rotation.from_rotvec(ends * t).as_quat() for t in np.linspace(0.1, 1.0, frames)])
    return poses_from_rotations(rig.skeleton, local, root_position=np.linspace([0.0] * 3, [0.2, 0.1, -0.3], frames))


def assert_same(found: Poses, wanted: Poses, rig: Rig) -> None:
    own = [j for j, source in enumerate(rig.sources) if source >= 0]
    assert len(found) == len(wanted)
    np.testing.assert_allclose(found.positions[:, own], wanted.positions[:, own], atol=PLACE)
    turns = [Rotation.from_quat(poses.rotations[:, own].reshape(-1, 4)) for poses in (found, wanted)]
    assert (turns[0] * turns[1].inv()).magnitude().max() < TURN


@pytest.mark.parametrize("flat", [False, True])
def test_what_was_written_comes_back(rig: Rig, tmp_path: Path, flat: bool) -> None:
    assert rig.source is not None
    if flat:
        rig = replace(rig, source=replace(rig.source, parents=np.full(len(rig.source), -1)))
    poses = turning(rig)
    write_motion(tmp_path / "own.bvh", rig, poses, rate=25.0)
    read = open_motion(tmp_path / "own.bvh", rig)
    assert read.rate == 25.0
    assert not read.warnings
    assert any("own skeleton" in note for note in read.notes)
    assert_same(read.poses, poses, rig)


@pytest.mark.parametrize("offset", ["where it rests", "zero, and the channels in the world", "elsewhere"])
def test_other_units_and_axes(rig: Rig, tmp_path: Path, offset: str) -> None:
    poses = turning(rig)
    write_motion(tmp_path / "own.bvh", rig, poses, rate=25.0)
    clip = read_bvh(tmp_path / "own.bvh")
    turn = Rotation.from_matrix(Z_UP)
    rotations = (turn * Rotation.from_quat(clip.rotations.reshape(-1, 4)) * turn.inv()).as_quat()
    rest, positions = 100.0 * clip.rest @ Z_UP.T, 100.0 * clip.positions @ Z_UP.T
    if offset != "where it rests":
        rest = rest - rest[0]
    if offset == "elsewhere":  # the channels say how far from there
        positions = positions - 100.0 * clip.rest[0] @ Z_UP.T
    other = replace(clip, rest=rest, positions=positions, rotations=rotations.reshape(clip.rotations.shape))
    played = own_capture(other, rig)
    assert played is not None
    assert rig.source is not None
    again = own_capture(clip, rig)
    assert again is not None
    np.testing.assert_allclose(played[0].worlds, again[0].worlds, atol=PLACE)


def test_another_rest_or_another_skeleton_is_retargeted(rig: Rig, tmp_path: Path) -> None:
    write_motion(tmp_path / "own.bvh", rig, turning(rig), rate=25.0)
    clip = read_bvh(tmp_path / "own.bvh")
    longer = clip.rest.copy()
    longer[clip.names.index(rig.source_joints[4])] += 0.02
    assert own_capture(replace(clip, rest=longer), rig) is None
    assert own_capture(replace(clip, names=tuple(f"bone{n}" for n in range(len(clip.names)))), rig) is None
    tilted = Rotation.from_rotvec([0.0, 0.3, 0.0]).apply(clip.rest)
    assert own_capture(replace(clip, rest=tilted), rig) is None


def test_another_rate(rig: Rig, tmp_path: Path) -> None:
    poses = turning(rig, frames=9)
    write_motion(tmp_path / "own.bvh", rig, poses, rate=30.0)
    read = open_motion(tmp_path / "own.bvh", rig, rate=15.0)
    assert read.rate == 15.0
    assert_same(read.poses, poses[::2], rig)
