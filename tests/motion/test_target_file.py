"""Files of target shapes: what is read, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.motion.target_file import read_targets
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, poses_from_angles

NAMES = np.array(["index.base.flexion", "thumb.base.abduction", "root.y"])
ANGLES = np.array([[30.0, -10.0, 0.0], [60.0, 0.0, 0.02]])


@pytest.fixture(scope="module")
def rig(hands: dict[str, Rig]) -> Rig:
    return hands["left"]


def shapes(rig: Rig) -> np.ndarray:
    source = rig.surface.to_source(rig.surface.vertices.astype(np.float32))
    return np.stack([source, source + 1e-3])


def write(path: Path, **arrays: np.ndarray) -> Path:
    np.savez(path, **arrays)
    return path


def test_poses_of_its_own(rig: Rig, tmp_path: Path) -> None:
    found = read_targets(write(tmp_path / "a.npz", vertices=shapes(rig), channels=NAMES, angles=ANGLES), rig)
    angles = np.zeros((2, len(rig.skeleton), len(CHANNELS)))
    for name, column in (("index.base.flexion", 0), ("thumb.base.abduction", 1)):
        joint, _, channel = name.rpartition(".")
        angles[:, rig.skeleton.index(joint), CHANNELS.index(channel)] = np.radians(ANGLES[:, column])
    wanted = poses_from_angles(rig.skeleton, angles, root_position=ANGLES[:, 2:] * [0.0, 1.0, 0.0])
    np.testing.assert_allclose(found.poses.rotations, wanted.rotations, atol=1e-12)
    np.testing.assert_allclose(found.poses.positions, wanted.positions, atol=1e-12)
    np.testing.assert_allclose(found.vertices[0], rig.surface.vertices, atol=1e-6)
    np.testing.assert_allclose(found.vertices[1] - found.vertices[0], 1e-3, atol=1e-6)


def test_vertices_that_are_one_point_are_averaged(rig: Rig, tmp_path: Path) -> None:
    doubled = np.concatenate([rig.surface.weld, rig.surface.weld[:5]]).astype(np.int32)
    split = replace(rig, surface=replace(rig.surface, weld=doubled))
    vertices = np.concatenate([shapes(rig), shapes(rig)[:, :5] + np.float32(2e-3)], axis=1)
    found = read_targets(write(tmp_path / "a.npz", vertices=vertices, channels=NAMES, angles=ANGLES), split)
    moved = rig.surface.weld[:5]
    np.testing.assert_allclose(found.vertices[0, moved], rig.surface.vertices[moved] + 1e-3, atol=1e-6)


def test_poses_of_a_motion_file(rig: Rig, tmp_path: Path) -> None:
    motion = tmp_path / "poses.csv"
    motion.write_text("frame,index.base.flexion\n0,30\n1,60\n", encoding="utf-8")
    found = read_targets(write(tmp_path / "a.npz", vertices=shapes(rig)), rig, motion=motion)
    index = rig.skeleton.index("index.base")
    np.testing.assert_allclose(np.degrees(found.poses.flexion[:, index]), [30.0, 60.0], atol=1e-9)
    with pytest.raises(InputError, match="2 frames for 1 target shapes"):
        read_targets(write(tmp_path / "b.npz", vertices=shapes(rig)[:1]), rig, motion=motion)
    both = write(tmp_path / "c.npz", vertices=shapes(rig), channels=NAMES, angles=ANGLES)
    with pytest.raises(InputError, match="poses of its own"):
        read_targets(both, rig, motion=motion)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"vertices": None}, "no array 'vertices'"),
        ({"vertices": np.zeros((2, 7, 3))}, "the rig's vertices, got"),
        ({"vertices": np.array(["a"])}, "'vertices': want numbers"),
        ({"channels": None}, "no array 'channels'"),
        ({"channels": np.array([1.0, 2.0, 3.0])}, "'channels': want text"),
        ({"channels": np.array(["index.base.flexion", "elbow.flexion", "root.y"])}, "elbow"),
        ({"channels": np.array(["index.base.flexion", "index.base.bend", "root.y"])}, "no angle 'bend'"),
        ({"channels": NAMES[[0, 0, 2]]}, "'index.base.flexion' is listed twice"),
        ({"angles": None}, "no array 'angles'"),
        ({"angles": ANGLES[:1]}, r"'angles': want shape \(2, 3\)"),
        ({"angles": np.where(ANGLES == 30.0, np.nan, ANGLES)}, "index.base.flexion is not finite at frame 0"),
        ({"angles": np.where(ANGLES == 30.0, 170.0, ANGLES)}, "above its limit"),
    ],
)
def test_what_is_refused(rig: Rig, tmp_path: Path, change: dict[str, np.ndarray | None], says: str) -> None:
    arrays = {"vertices": shapes(rig), "channels": NAMES, "angles": ANGLES} | change
    path = write(tmp_path / "a.npz", **{name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=says) as caught:
        read_targets(path, rig)
    assert caught.value.path is not None
    assert "\n" not in str(caught.value)


def test_not_finite_vertices(rig: Rig, tmp_path: Path) -> None:
    vertices = shapes(rig)
    vertices[1, 4, 2] = np.nan
    with pytest.raises(InputError, match="vertex 4 is not finite at frame 1"):
        read_targets(write(tmp_path / "a.npz", vertices=vertices, channels=NAMES, angles=ANGLES), rig)


def test_files_that_are_none(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(b"nothing")
    with pytest.raises(InputError, match="no archive of NumPy arrays"):
        read_targets(tmp_path / "a.npz", rig)
    with pytest.raises(InputError, match="cannot be read"):
        read_targets(tmp_path / "none.npz", rig)
    with pytest.raises(InputError, match="want a NumPy archive"):
        read_targets(tmp_path / "a.obj", rig)
