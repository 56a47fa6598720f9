"""VRM avatars whose joints' names say nothing, and VRM animations that drive them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.glb_files import Glb
from tests.io.vrm_files import BONES, CANONICAL, HAIR, animation, avatar, with_humanoid
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.vrm import read_vrm_rig
from warpjld.motion.load import load_motion
from warpjld.motion.vrma import read_vrma

TURNS = {"0": Rotation.from_euler("y", 180.0, degrees=True).as_matrix(), "1": np.eye(3)}
"""VRM 0.x avatars face -Z, those of 1.0 face +Z."""


@pytest.fixture(scope="module", params=["0", "1"])
def vrm(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, write_glb: Callable[[Glb, Path], Path]
) -> tuple[str, Path]:
    version = request.param
    path = write_glb(avatar(TURNS[version]), tmp_path_factory.mktemp("vrm") / f"avatar{version}.vrm")
    return version, with_humanoid(path, version, {name: j for j, name in enumerate(BONES)})


def test_every_stated_joint_is_recognised(vrm: tuple[str, Path]) -> None:
    version, path = vrm
    rig = load_rig(path)
    for bone, (_, place) in BONES.items():
        joint = rig.skeleton.names.index(CANONICAL[bone])
        np.testing.assert_allclose(rig.skeleton.rest[joint], TURNS[version] @ place, atol=1e-5, err_msg=bone)
        assert rig.source is not None
        np.testing.assert_allclose(rig.source.positions[rig.sources[joint]], TURNS[version] @ place, atol=1e-6)
    assert len(rig.source.names) == len(BONES) + len(HAIR)
    assert {f"{side}.{digit}.tip" for side in ("left", "right") for digit in ("thumb", "pinky")} <= set(
        rig.skeleton.names
    )


def test_the_table_wins_over_names_that_mislead(write_glb: Callable[[Glb, Path], Path], tmp_path: Path) -> None:
    glb = avatar(np.eye(3))
    glb.names = [*reversed(BONES), *(f"hair{n}" for n in range(len(HAIR)))]
    path = write_glb(glb, tmp_path / "a.vrm")
    rig = load_rig(with_humanoid(path, "1", {name: j for j, name in enumerate(BONES)}))
    for j, bone in enumerate(BONES):
        assert rig.sources[rig.skeleton.names.index(CANONICAL[bone])] == j, bone


def test_bones_that_no_skin_uses_are_joints(write_glb: Callable[[Glb, Path], Path], tmp_path: Path) -> None:
    import pygltflib

    path = write_glb(avatar(np.eye(3)), tmp_path / "a.vrm")
    gltf = pygltflib.GLTF2().load_binary(str(path))
    mesh = next(n for n in gltf.nodes if n.mesh is not None)
    toes = [list(BONES).index(f"{side}Toes") for side in ("left", "right")]
    # the toes are last of the skin, and nothing is painted on them
    order = [n for n in gltf.skins[0].joints if n not in toes]
    assert mesh.skin == 0
    glb = avatar(np.eye(3))
    keep = [j for j in range(len(glb.names)) if j not in toes]
    place = {j: k for k, j in enumerate(keep)} | {t: glb.parents[t] for t in toes}
    glb.joints = np.array([[place[int(j)] if int(j) in keep else place[glb.parents[int(j)]]] for j in glb.joints[:, 0]])
    write_glb(glb, path)
    gltf = pygltflib.GLTF2().load_binary(str(path))
    binds = gltf.accessors[gltf.skins[0].inverseBindMatrices]
    data = np.frombuffer(gltf.binary_blob(), "<f4", 16 * binds.count, gltf.bufferViews[binds.bufferView].byteOffset)
    kept = data.reshape(-1, 16)[keep].copy()
    blob = bytearray(gltf.binary_blob())
    start = gltf.bufferViews[binds.bufferView].byteOffset
    blob[start : start + kept.nbytes] = kept.tobytes()
    binds.count = len(keep)
    gltf.skins[0].joints = order
    gltf.set_binary_blob(bytes(blob))
    gltf.save_binary(str(path))
    rig = read_vrm_rig(with_humanoid(path, "1", {name: j for j, name in enumerate(BONES)}))
    assert len(rig.tree) == len(glb.names)
    for side in ("left", "right"):
        toe = rig.stated[f"{side}.ball"]
        np.testing.assert_allclose(rig.tree.positions[toe], BONES[f"{side}Toes"][1], atol=1e-6)
        assert rig.tree.parents[toe] == rig.stated[f"{side}.ankle"]


def test_an_animation_points_limbs_where_it_says(vrm: tuple[str, Path], tmp_path: Path) -> None:
    version, path = vrm
    frames = 5
    steps = np.linspace(0.0, 1.0, frames)[:, None]
    turns = {
        "leftUpperArm": steps * [0.0, 0.0, -1.2],  # lowered
        "leftLowerArm": steps * [0.0, -1.4, 0.0],  # forward
        "rightUpperLeg": steps * [-0.8, 0.0, 0.0],  # lifted in front
        "rightLowerLeg": steps * [0.7, 0.0, 0.0],  # bent back
        "head": steps * [0.0, 0.5, 0.0],
        "rightIndexProximal": steps * [0.0, 0.0, 0.9],
    }
    travel = steps * [0.0, 0.0, 0.55]
    rig = load_rig(path)
    motion = load_motion(animation(tmp_path / "dance.vrma", turns, travel), rig)
    assert motion.rate == 30.0
    names = rig.skeleton.names
    for bone, end in (
        ("leftUpperArm", "leftLowerArm"),
        ("leftLowerArm", "leftHand"),
        ("rightUpperLeg", "rightLowerLeg"),
        ("rightLowerLeg", "rightFoot"),
        ("rightIndexProximal", "rightIndexIntermediate"),
        ("rightUpperArm", "rightLowerArm"),
    ):
        a, b = names.index(CANONICAL[bone]), names.index(CANONICAL[end])
        shown = motion.poses.positions[:, b] - motion.poses.positions[:, a]
        shown /= np.linalg.norm(shown, axis=1, keepdims=True)
        rest = np.subtract(BONES[end][1], BONES[bone][1])
        turned = Rotation.from_rotvec(turns.get(bone, np.zeros((frames, 3)))).apply(rest / np.linalg.norm(rest))
        np.testing.assert_allclose(shown, turned @ TURNS[version].T, atol=1e-5, err_msg=bone)
    pelvis = motion.poses.positions[:, names.index("pelvis")]
    forward = TURNS[version] @ [0.0, 0.0, 1.0]
    # the animation's person is a tenth taller
    np.testing.assert_allclose((pelvis - pelvis[0]) @ forward, 0.5 * steps[:, 0], atol=1e-4)


def test_an_animation_keeps_the_tables_hierarchy(tmp_path: Path) -> None:
    read = read_vrma(animation(tmp_path / "a.vrma", {}, np.zeros((2, 3))))
    assert len(read.tree) == len(BONES)
    assert read.tree.names[read.tree.parents[read.tree.names.index("LeftHandThumb1")]] == "LeftHand"
    assert "RightHandPinky3" in read.tree.names


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (None, "has no VRMC_vrm or VRM extension"),
        ({"VRMC_vrm": {}}, "humanoid table is broken"),
        ({"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 999}}}}}, "node 999, which does not exist"),
        ({"VRM": {"humanoid": {"humanBones": [{"bone": "hips"}]}}}, "humanoid table is broken"),
        ({"VRM": {"humanoid": {"humanBones": 3}}}, "humanoid table is broken"),
        (
            {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 1}, "head": {"node": 1}}}}},
            "is two bones",
        ),
    ],
)
def test_a_broken_table_is_told(
    write_glb: Callable[[Glb, Path], Path], tmp_path: Path, table: dict[str, object] | None, says: str
) -> None:
    import pygltflib

    path = write_glb(avatar(np.eye(3)), tmp_path / "a.vrm")
    gltf = pygltflib.GLTF2().load_binary(str(path))
    gltf.extensions = table or {}
    gltf.save_binary(str(path))
    with pytest.raises(InputError, match=says) as caught:
        load_rig(path)
    assert caught.value.path == path
