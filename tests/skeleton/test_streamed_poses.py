"""Poses computed a block at a time are, bit for bit, those computed at once; long scenes fit into little memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.finger import finger
from tests.motion import skinned_files
from tests.peak import peak
from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.crowd import Crowd, role_of
from warpjld.script.outermost import outermost
from warpjld.script.outputs import CameraSetting
from warpjld.script.staging import stage, staged
from warpjld.skeleton import Poses
from warpjld.skeleton.streamed_poses import BLOCK, StreamedPoses, blocks_of

_COUNT = 2 * BLOCK + 77
_FRAMES = np.arange(_COUNT, dtype=np.float64)


@pytest.fixture(scope="module")
def scene() -> Scene:
    scene = Scene(say=lambda text: None)
    scene.add("finger", finger())
    Interpreter(scene).run_text(
        f"FRAMES 0 {_COUNT - 1}\nJOINT index.base FLEXION 0 0 1 0\nJOINT index.base FLEXION {_COUNT} {_COUNT} 1 60\n"
        f"MOVE finger 0 0 0 0\nMOVE finger {_COUNT} 0.3 0.1 0\nTURN finger 0 0 0 0\nTURN finger {_COUNT} 30 200 10\n"
    )
    return scene


def _same(one: Poses, other: Poses) -> None:
    for name in ("positions", "rotations", "flexion"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_slices_and_arrays_are_those_of_all_frames_at_once(scene: Scene) -> None:
    actor = scene.actor()
    whole, some = stage(actor, _FRAMES, scene.rate), staged(actor, _FRAMES, scene.rate)
    assert isinstance(some, StreamedPoses)
    assert len(some) == _COUNT
    for part in (slice(0, 16), slice(BLOCK - 3, BLOCK + 3), slice(5, 5), slice(_COUNT - 1, None), slice(40, 3)):
        _same(some[part], whole[part])
    for part in (slice(10, None), slice(None, None, 7), slice(None, None, -1)):
        assert isinstance(some[part], StreamedPoses)
        _same(some[part], whole[part])
    _same(some, whole)
    assert [(start, len(block)) for start, block in blocks_of(some)] == [(0, BLOCK), (BLOCK, BLOCK), (2 * BLOCK, 77)]


def test_no_more_than_a_block_is_computed_at_once_and_none_twice() -> None:
    asked: list[int] = []

    def posed(frames: np.ndarray) -> Poses:
        asked.append(len(frames))
        return Poses(np.zeros((len(frames), 1, 3)), np.zeros((len(frames), 1, 4)), np.zeros((len(frames), 1)))

    poses = StreamedPoses(_FRAMES, posed)
    for start in range(0, _COUNT, 16):
        assert len(poses[start : start + 16]) == min(16, _COUNT - start)
    assert max(asked) <= BLOCK
    assert sum(asked) <= _COUNT + 1


def test_what_cannot_be_posed_is_refused_at_once(scene: Scene) -> None:
    def posed(frames: np.ndarray) -> Poses:
        raise InputError("no such joint")

    with pytest.raises(InputError, match="no such joint"):
        StreamedPoses(_FRAMES, posed)


def test_a_camera_shows_every_joint_of_a_long_scene(scene: Scene) -> None:
    crowd = Crowd([role_of(scene.actor(), _FRAMES, scene.rate)], _FRAMES)
    points = crowd._framing(CameraSetting())
    joints = stage(scene.actor(), _FRAMES, scene.rate).positions.reshape(-1, 3)
    assert len(points) < len(joints)
    for direction in np.random.default_rng(3).normal(size=(40, 3)):
        assert (joints @ direction).max() <= (points @ direction).max() + 1e-12


@pytest.mark.parametrize("flat", [0, 1, 2, 3])
def test_outermost_points_reach_as_far_as_all(flat: int) -> None:
    points = np.random.default_rng(flat).normal(size=(200, 3))
    points[:, :flat] = 0.25
    some = outermost(points)
    assert len(some) < len(points)
    for axis in range(3):
        assert some[:, axis].min() <= points[:, axis].min() + 1e-12
        assert some[:, axis].max() >= points[:, axis].max() - 1e-12


@pytest.mark.slow
def test_a_hundred_thousand_frames_of_a_hand_within_450_mb(tmp_path: Path) -> None:
    script = tmp_path / "long.jld"
    script.write_text(
        "HAND LEFT BUILTIN RESOLUTION 1500\nFINGER1 LEFT INDEX FLEXION 0 0 1 0\n"
        "FINGER1 LEFT INDEX FLEXION 99999 99999 1 60\nEXPORT 'x.pc2'\n"
    )
    assert peak("run", str(script), "-o", "out", "--quiet", folder=tmp_path) < 450.0
    assert (tmp_path / "out" / "x.pc2").stat().st_size > 100_000 * 1400 * 12


@pytest.mark.slow
def test_a_million_frames_run(tmp_path: Path) -> None:
    vertices = np.array([[x, y, z] for z in (0.01, -0.04, -0.1) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))], float)
    vertices[:, :2] *= 0.008
    sides = [[a, b, a + 4, b, b + 4, a + 4] for k in (0, 4) for a, b in ((k + i, k + (i + 1) % 4) for i in range(4))]
    faces = np.concatenate([np.reshape(sides, (-1, 3)), [[0, 2, 1], [0, 3, 2], [8, 9, 10], [8, 10, 11]]])
    joints = np.zeros((len(vertices), 4), np.uint16)
    joints[4:, 0], joints[8:, 0] = 1, 2
    weights = np.tile(np.float32([1, 0, 0, 0]), (len(vertices), 1))
    offsets, turns = np.array([[0, 0, 0], [0, 0, -0.05], [0, 0, -0.04]]), np.tile([0.0, 0, 0, 1], (3, 1))
    rig = skinned_files.Skinned(["one", "two", "three"], [-1, 0, 1], offsets, turns, vertices, faces, joints, weights)
    skinned_files.write(tmp_path / "rig.glb", rig, {})
    (tmp_path / "long.jld").write_text(
        'BODY "rig.glb" UNIT M NAME finger\nFRAMES 0 999999\nMOVE finger 0 0 0 0\n'
        'MOVE finger 999999 0.1 0 0\nEXPORT "x.pc2"\n'
    )
    assert peak("run", "long.jld", "-o", "out", "--quiet", folder=tmp_path) < 450.0
    assert (tmp_path / "out" / "x.pc2").stat().st_size >= 1_000_000 * 12 * 12
