"""BVH written, read back by matrices of the test's own and by another library."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from tests.motion.out.bvh_reader import evaluate
from warpjld.io import load_rig
from warpjld.motion.bvh import read_bvh
from warpjld.motion.out import write_motion
from warpjld.motion.out.euler import ContinuousEuler
from warpjld.rig import Rig
from warpjld.skeleton import Poses, poses_from_rotations, poses_from_world, rest_poses

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"


@pytest.fixture(scope="module")
def hand(hands: dict[str, Rig]) -> Rig:
    return hands["left"]


def turning(rig: Rig, frames: int, seed: int = 0) -> Poses:
    """Joints that turn far, all about axes of their own, on a root that goes away."""
    draw = np.random.default_rng(seed)
    ends = Rotation.from_rotvec(draw.normal(0.0, 1.2, (len(rig.skeleton), 3)))
    local = np.stack([(Rotation.from_rotvec(ends.as_rotvec() * t)).as_quat() for t in np.linspace(0.0, 1.0, frames)])
    root = np.linspace(0.0, 1.0, frames)[:, None] * np.array([0.4, 1.0, -0.3])
    return poses_from_rotations(rig.skeleton, local, root_position=root)


def test_positions_and_rotations(hand: Rig, tmp_path: Path) -> None:
    poses = turning(hand, 7)
    write_motion(tmp_path / "a.bvh", hand, poses, rate=24.0)
    names, parents, _, worlds, seconds = evaluate(tmp_path / "a.bvh")
    assert seconds == pytest.approx(1 / 24, rel=1e-9)
    assert sorted(names) == sorted(hand.skeleton.names)
    for b, name in enumerate(names):
        j = hand.skeleton.names.index(name)
        above = hand.skeleton.parents[j]
        assert parents[b] == (-1 if above < 0 else names.index(hand.skeleton.names[above]))
        np.testing.assert_allclose(worlds[:, b, :3, 3], poses.positions[:, j], atol=1e-6)
        turns = Rotation.from_quat(poses.rotations[:, j]).as_matrix()
        np.testing.assert_allclose(worlds[:, b, :3, :3], turns, atol=1e-6)


def test_only_what_moves_has_position_channels(hand: Rig, tmp_path: Path) -> None:
    poses = turning(hand, 4)
    write_motion(tmp_path / "a.bvh", hand, poses, rate=30.0)
    assert (tmp_path / "a.bvh").read_text().count("Xposition") == 1
    positions = poses.positions.copy()
    tip = hand.skeleton.index("index.tip")
    positions[2, tip] += (0.01, 0.0, 0.0)  # a bone that grows
    written = write_motion(
        tmp_path / "b.bvh", hand, poses_from_world(hand.skeleton, positions, poses.rotations), rate=30.0
    )
    assert (tmp_path / "b.bvh").read_text().count("Xposition") == 2
    assert any("position channels" in note and "left.index.tip" in note for note in written.notes)
    names, _, _, worlds, _ = evaluate(tmp_path / "b.bvh")
    np.testing.assert_allclose(worlds[:, names.index("left.index.tip"), :3, 3], positions[:, tip], atol=1e-6)


def test_several_roots_hang_on_one(hand: Rig, tmp_path: Path) -> None:
    assert hand.source is not None
    flat = replace(hand, source=replace(hand.source, parents=np.full(len(hand.source), -1)))
    poses = turning(hand, 5)
    written = write_motion(tmp_path / "a.bvh", flat, poses, rate=30.0)
    assert any("26 roots are attached to 'root'" in note for note in written.notes)
    names, parents, _, worlds, _ = evaluate(tmp_path / "a.bvh")
    assert names[0] == "root"
    assert set(parents) == {-1, 0}
    for b, name in enumerate(names[1:], start=1):
        expected = poses.positions[:, hand.skeleton.names.index(name)]
        np.testing.assert_allclose(worlds[:, b, :3, 3], expected, atol=1e-6)


def test_names_that_readers_split(hand: Rig, tmp_path: Path) -> None:
    assert hand.source is not None
    odd = ("fore arm", "fore_arm", "a{b}", "", *hand.source.names[4:])
    rig = replace(hand, source=replace(hand.source, names=odd))
    written = write_motion(tmp_path / "a.bvh", rig, rest_poses(rig.skeleton), rate=30.0)
    names = evaluate(tmp_path / "a.bvh")[0]
    assert {"fore_arm", "fore_arm_2", "a(b)", "joint3"} <= set(names)
    assert any("'fore arm' → fore_arm" in note for note in written.notes)


def test_end_sites_are_the_tips_that_were_added(tmp_path: Path) -> None:
    path = SHARED / "hand_anny" / "left.glb"
    if not path.is_file():
        pytest.skip(f"no {path.name} beside the repository")
    rig = load_rig(path)
    write_motion(tmp_path / "a.bvh", rig, rest_poses(rig.skeleton), rate=30.0)
    text = (tmp_path / "a.bvh").read_text()
    assert rig.source is not None
    last = rig.source.names[rig.sources[rig.skeleton.index("index.knuckle3")]]
    lines = text[text.index(f"JOINT {last}\n") :].splitlines()
    end = np.array([line.split()[1:] for line in lines if "OFFSET" in line][1], dtype=float)
    tip = rig.skeleton.rest[rig.skeleton.index("index.tip")]
    base = rig.skeleton.rest[rig.skeleton.index("index.knuckle3")]
    np.testing.assert_allclose(end, tip - base, atol=1e-7)


def test_another_library_takes_it(hand: Rig, tmp_path: Path) -> None:
    bvhio = pytest.importorskip("bvhio")
    poses = turning(hand, 4)
    write_motion(tmp_path / "a.bvh", hand, poses, rate=25.0)
    root = bvhio.readAsHierarchy(str(tmp_path / "a.bvh"))
    for frame in range(4):
        root.loadPose(frame)
        shown = {joint.Name: list(joint.PositionWorld) for joint, _, _ in root.layout()}
        places = np.array([shown[name] for name in hand.skeleton.names])
        np.testing.assert_allclose(places, poses.positions[frame], atol=1e-5)  # it computes in float32


def test_the_packages_own_reader_takes_it(hand: Rig, tmp_path: Path) -> None:
    poses = turning(hand, 6)
    write_motion(tmp_path / "a.bvh", hand, poses, rate=25.0)
    clip = read_bvh(tmp_path / "a.bvh")
    assert clip.rate == 25.0
    own = [clip.names.index(name) for name in hand.skeleton.names]
    np.testing.assert_allclose(clip.positions[:, own], poses.positions, atol=1e-6)
    same = np.abs((clip.rotations[:, own] * poses.rotations).sum(-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-9)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.booleans())
def test_angles_do_not_jump(seed: int, locked: bool) -> None:
    """Half a turn and more, through gimbal lock: the same rotations, in steps that stay small away from the lock."""
    draw = np.random.default_rng(seed)
    keys = Rotation.random(5, random_state=seed)
    if locked:  # x is ±90° at a key
        keys = Rotation.concatenate(
            [keys[:2], Rotation.from_euler("ZXY", [draw.uniform(-3, 3), np.pi / 2, 0.7]), keys[2:4]]
        )
    turns = Slerp(np.linspace(0, 1, 5), keys)(np.linspace(0, 1, 801)).as_matrix()
    angles = np.concatenate([euler[:, 0] for euler in _by_blocks(turns)])
    back = Rotation.from_euler("ZXY", angles).as_matrix()
    np.testing.assert_allclose(back, turns, atol=1e-6)
    clear = np.abs(np.cos(angles[:, 1])) > 0.2
    steps = np.abs(np.diff(angles, axis=0)).max(axis=1)[clear[1:] & clear[:-1]]
    assert steps.max() < np.radians(15.0)


def _by_blocks(turns: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    euler = ContinuousEuler(1)
    return [euler(turns[:300, None]), euler(turns[300:, None])]


def test_a_full_turn_goes_on(hand: Rig, tmp_path: Path) -> None:
    """A root that turns twice about Y: the channel goes to 720°, not back to 0."""
    turns = np.zeros((37, len(hand.skeleton), 4))
    turns[..., 3] = 1.0
    angle = np.radians(np.linspace(0.0, 720.0, 37))
    turns[:, 0, 1], turns[:, 0, 3] = np.sin(angle / 2), np.cos(angle / 2)
    write_motion(tmp_path / "a.bvh", hand, poses_from_rotations(hand.skeleton, turns), rate=30.0)
    values = evaluate(tmp_path / "a.bvh")[2]
    np.testing.assert_allclose(values[:, 5], np.linspace(0.0, 720.0, 37), atol=1e-5)
