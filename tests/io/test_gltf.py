"""What glTF allows and loaders get wrong, on files written here."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.skeleton import hand_joint_names

# positions are stored as float32
CLOSE = 1e-6


def same_rest(rig, built, atol=CLOSE):
    want = [built.skeleton.rest[built.skeleton.index(name)] for name in hand_joint_names("left")]
    assert rig.skeleton.names == hand_joint_names("left")
    np.testing.assert_allclose(rig.skeleton.rest, want, atol=atol)
    np.testing.assert_allclose(rig.surface.vertices, built.surface.vertices, atol=atol)
    np.testing.assert_array_equal(rig.surface.faces, built.surface.faces)
    np.testing.assert_allclose(rig.skin.weights.sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("axis", [(0, 1, 0), (1, 0, 0), (0, 0, -1), (-1, 0, 0)])
@pytest.mark.parametrize("flat", [False, True])
def test_bone_axis_conventions_and_flat_files_give_the_same_rig(write_glb, hand_glb, hands, tmp_path, axis, flat):
    named = load_rig(write_glb(replace(hand_glb(axis=axis), flat=flat), tmp_path / "named.glb"))
    same_rest(named, hands["left"])
    number = iter(range(100))
    glb = replace(hand_glb(axis=axis, names=lambda name: f"bone_{next(number):03d}"), flat=flat)
    unnamed = load_rig(write_glb(glb, tmp_path / "unnamed.glb"))
    same_rest(unnamed, hands["left"])
    np.testing.assert_allclose(unnamed.skeleton.axes, named.skeleton.axes, atol=1e-9)


def test_axes_agree_with_those_the_built_in_hand_was_made_with(write_glb, hand_glb, hands, tmp_path):
    for side in ("left", "right"):
        rig = load_rig(write_glb(hand_glb(side), tmp_path / f"{side}.glb"))
        for name in hand_joint_names(side):
            cosine = (
                rig.skeleton.axes[rig.skeleton.index(name)]
                @ hands[side].skeleton.axes[hands[side].skeleton.index(name)]
            )
            assert cosine > np.cos(np.radians(12)), name


def test_six_influences_survive(write_glb, hand_glb, tmp_path):
    glb = hand_glb()
    rig = load_rig(write_glb(glb, tmp_path / "six.glb"))
    dense = np.zeros((len(glb.vertices), 25))
    np.put_along_axis(dense, glb.joints, glb.weights, axis=1)
    got = np.zeros_like(dense)
    np.add.at(got, (np.arange(len(dense))[:, None], rig.skin.joints), rig.skin.weights)
    assert (rig.skin.weights > 0).sum(axis=1).max() == 6
    np.testing.assert_allclose(got, dense, atol=1e-6)


def test_the_mesh_nodes_transform_does_not_count(write_glb, hand_glb, hands, tmp_path):
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = Rotation.from_euler("xyz", [1, 2, 3]).as_matrix() * 7, [5, 6, 7]
    same_rest(load_rig(write_glb(replace(hand_glb(), mesh_node=moved), tmp_path / "a.glb")), hands["left"])


def test_an_armature_that_scales_and_turns_places_joints_and_vertices_alike(write_glb, hand_glb, hands, tmp_path):
    armature = np.eye(4)
    armature[:3, :3], armature[:3, 3] = Rotation.from_euler("xyz", [0.3, 1, 2]).as_matrix() * 1.1, [0.1, 0.2, 0.3]
    glb = hand_glb()
    placed = glb.vertices @ armature[:3, :3].T + armature[:3, 3]
    rig = load_rig(write_glb(replace(glb, armature=armature, vertices=placed), tmp_path / "a.glb"))
    rest = hands["left"].skeleton.rest[[hands["left"].skeleton.index(n) for n in rig.skeleton.names]]
    np.testing.assert_allclose(rig.skeleton.rest, rest @ armature[:3, :3].T + armature[:3, 3], atol=CLOSE)
    np.testing.assert_allclose(rig.surface.vertices, placed, atol=CLOSE)


def test_a_bind_pose_that_differs_from_the_shown_pose(write_glb, hand_glb, hands, tmp_path):
    glb = hand_glb()
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("x", 0.4).as_matrix()
    shown = glb.frames.copy()
    below = [j for j, name in enumerate(glb.names) if ".index." in name and "carpo" not in name]
    pivot = np.eye(4)
    pivot[:3, 3] = glb.frames[below[0], :3, 3]
    shown[below] = pivot @ turn @ np.linalg.inv(pivot) @ shown[below]
    rig = load_rig(write_glb(replace(glb, frames=shown, bind_frames=glb.frames), tmp_path / "a.glb"))
    moves = shown @ np.linalg.inv(glb.frames)
    want = np.einsum("vk,vkij,vj->vi", glb.weights, moves[glb.joints][..., :3, :3], glb.vertices)
    want += np.einsum("vk,vki->vi", glb.weights, moves[glb.joints][..., :3, 3])
    np.testing.assert_allclose(rig.surface.vertices, want, atol=CLOSE)
    np.testing.assert_allclose(rig.skeleton.rest[rig.skeleton.index("index.tip")], shown[below[-1], :3, 3], atol=CLOSE)
    assert any("bind pose differs" in note for note in rig.notes)


@pytest.mark.parametrize(
    "liberty",
    [
        {"matrices": True},
        {"interleaved": True},
        {"sparse": True},
        {"split": True},
    ],
    ids=lambda liberty: next(iter(liberty)),
)
def test_liberties_of_the_format(write_glb, hand_glb, hands, tmp_path, liberty):
    rig = load_rig(write_glb(replace(hand_glb(), **liberty), tmp_path / "a.glb"))
    if "split" in liberty:
        assert [part.name for part in rig.surface.parts] == ["mesh0", "mesh1"]
        assert len(rig.surface.faces) == len(hands["left"].surface.faces)
        used = rig.surface.vertices[rig.surface.faces]
        want = hands["left"].surface.vertices[hands["left"].surface.faces]
        np.testing.assert_allclose(used, want, atol=CLOSE)
    else:
        same_rest(rig, hands["left"])


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_normalised_integer_weights(write_glb, hand_glb, tmp_path, kind):
    exact = load_rig(write_glb(hand_glb(), tmp_path / "float.glb")).skin
    rough = load_rig(write_glb(replace(hand_glb(), weight_type=kind), tmp_path / "int.glb")).skin
    np.testing.assert_allclose(rough.weights.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(rough.weights.max(axis=1), exact.weights.max(axis=1), atol=4 / np.iinfo(kind).max)


def test_uv_seams_are_welded_for_geometry_and_kept_for_export(write_glb, hand_glb, tmp_path):
    glb = hand_glb()
    seam = np.unique(glb.faces[:200])
    double = np.arange(len(glb.vertices))
    double[seam] = len(glb.vertices) + np.arange(len(seam))
    faces = glb.faces.copy()
    faces[:200] = double[faces[:200]]
    uv = np.random.default_rng(0).random((len(glb.vertices) + len(seam), 2))
    split = replace(
        glb,
        vertices=np.vstack([glb.vertices, glb.vertices[seam]]),
        joints=np.vstack([glb.joints, glb.joints[seam]]),
        weights=np.vstack([glb.weights, glb.weights[seam]]),
        faces=faces,
        uv=uv,
    )
    rig = load_rig(write_glb(split, tmp_path / "seam.glb"))
    assert len(rig.surface.vertices) == len(glb.vertices)
    written = rig.surface.to_source(rig.surface.vertices.astype(np.float32))
    used = np.unique(faces)
    np.testing.assert_allclose(written, split.vertices[used], atol=CLOSE)
    # glTF counts v downwards, this project upwards
    np.testing.assert_allclose(rig.surface.uv, uv[used] * [1, -1] + [0, 1], atol=CLOSE)


@pytest.mark.parametrize("unit", ["cm", "mm", "in"])
def test_units_are_guessed_from_the_hands_size(write_glb, hand_glb, hands, tmp_path, unit):
    factor = {"cm": 100.0, "mm": 1000.0, "in": 1 / 0.0254}[unit]
    glb = hand_glb()
    frames = glb.frames.copy()
    frames[:, :3, 3] *= factor
    path = write_glb(replace(glb, frames=frames, vertices=glb.vertices * factor), tmp_path / "big.glb")
    rig = load_rig(path)
    same_rest(rig, hands["left"])
    assert any(f"taken to be in {unit}" in note for note in rig.notes)
    same_rest(load_rig(path, unit=unit), hands["left"])
    placed = rig.placing @ rig.source.frames[list(rig.sources)]
    np.testing.assert_allclose(placed[:, :3, 3], rig.skeleton.rest, atol=CLOSE)


def test_z_up(write_glb, hand_glb, hands, tmp_path):
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # y up to z up
    glb = hand_glb()
    frames = glb.frames.copy()
    frames[:, :3, :3], frames[:, :3, 3] = turn @ frames[:, :3, :3], frames[:, :3, 3] @ turn.T
    path = write_glb(replace(glb, frames=frames, vertices=glb.vertices @ turn.T), tmp_path / "z.glb")
    same_rest(load_rig(path, up="z"), hands["left"])


def test_truncated_file(write_glb, hand_glb, tmp_path):
    path = write_glb(hand_glb(), tmp_path / "a.glb")
    data = path.read_bytes()
    for size in (3, 15, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:size])
        with pytest.raises(InputError, match=r"a\.glb: is (truncated|not a glTF)"):
            load_rig(path)


def test_not_gltf_at_all(tmp_path):
    path = tmp_path / "a.gltf"
    path.write_text("{]")
    with pytest.raises(InputError, match=r"not a glTF 2\.0 file"):
        load_rig(path)


def edited(path, change):
    """The file with its JSON changed."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    content = json.loads(data[20 : 20 + size])
    change(content)
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    path.write_bytes(head + text + rest)
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda g: g["nodes"][3].update(children=[0]), "is its own ancestor|has two parents"),
        (lambda g: g["nodes"][0].update(children=[999]), "child 999 does not exist"),
        (lambda g: g["nodes"][0].update(rotation=[0, 0, 0, 0]), "rotation is not a quaternion"),
        (lambda g: g["nodes"][0].update(translation=["a", 0, 0]), "cannot be read as a glTF 2.0 file"),
        (lambda g: g["accessors"][0].update(count=10**7), "needs bytes up to"),
        (lambda g: g["meshes"][0]["primitives"][0]["attributes"].update(POSITION="x"), "cannot be read as a glTF"),
        (lambda g: g["accessors"][0].update(componentType=1), "unknown type"),
        (lambda g: g["skins"][0].update(joints=[0, 77]), "joint node 77 does not exist"),
        (lambda g: g["bufferViews"][0].update(buffer=4), "buffer 4 does not exist"),
        (lambda g: g["nodes"][2].update(scale=[1e300, 1e300, 1e300]), "not finite or too large"),
        (lambda g: g.update(extensionsRequired=["KHR_draco_mesh_compression"]), "export it without compression"),
    ],
)
def test_a_broken_document_is_named(write_glb, hand_glb, tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        load_rig(edited(write_glb(hand_glb(), tmp_path / "a.glb"), change))


def test_no_skin(write_glb, hand_glb, tmp_path):
    with pytest.raises(InputError, match="has no skin"):
        load_rig(write_glb(replace(hand_glb(), skinned=False), tmp_path / "a.glb"))


def test_bad_numbers_are_named(write_glb, hand_glb, tmp_path):
    glb = hand_glb()
    vertices, joints, weights = glb.vertices.copy(), glb.joints.copy(), glb.weights.copy()
    vertices[7, 1] = np.nan
    with pytest.raises(InputError, match="vertex 7 is not finite"):
        load_rig(write_glb(replace(glb, vertices=vertices), tmp_path / "nan.glb"))
    joints[9, 0] = 40
    with pytest.raises(InputError, match="vertex 9 follows joint 40, the skin has 25"):
        load_rig(write_glb(replace(glb, joints=joints), tmp_path / "joint.glb"))
    with pytest.raises(InputError, match="no vertex has any weight"):
        load_rig(write_glb(replace(glb, weights=0 * weights), tmp_path / "weight.glb"))
    rig = load_rig(write_glb(replace(glb, weights=glb.weights * 0.5), tmp_path / "half.glb"))
    np.testing.assert_allclose(rig.skin.weights.sum(axis=1), 1.0, atol=1e-12)
    assert any("did not sum to one" in note for note in rig.notes)


def test_bad_arguments_are_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_rig(tmp_path / "missing.glb")
    with pytest.raises(InputError, match="side: want 'left' or 'right', got 'up'"):
        load_rig(tmp_path / "missing.glb", side="up")
