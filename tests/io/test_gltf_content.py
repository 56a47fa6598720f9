"""What of a glTF file counts: scenes, morphs, weights, mirrored nodes, textures, extensions, buffers."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pygltflib as gl
import pytest

from tests.motion.skinned_files import Skinned, animal, write
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion.animations import animation_names

CLOSE = 1e-6


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("plain") / "plain.glb", animal(), {})


def edit(source: Path, target: Path, change: object) -> Path:
    """A copy whose JSON was changed."""
    data = source.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    content = json.loads(data[20 : 20 + size])
    change(content)  # type: ignore[operator]
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    target.write_bytes(head + text + rest)
    return target


def as_text(source: Path, target: Path, media: str = "application/gltf-buffer", bom: bytes = b"") -> Path:
    """The same as .gltf with its buffer in a data URI."""
    gltf = gl.GLTF2().load(str(source))
    blob = gltf.binary_blob()
    content = json.loads(gltf.gltf_to_json())
    content["buffers"] = [{"byteLength": len(blob), "uri": f"data:{media};base64,{base64.b64encode(blob).decode()}"}]
    target.write_bytes(bom + json.dumps(content).encode())
    return target


def same_surface(a: Path, b: Path) -> None:
    first, second = load_rig(a), load_rig(b)
    np.testing.assert_allclose(first.surface.vertices, second.surface.vertices, atol=CLOSE)
    np.testing.assert_array_equal(first.surface.faces, second.surface.faces)


@pytest.mark.parametrize(
    "media", ["application/gltf-buffer", "application/octet-stream", "", "application/gltf-buffer;charset=x"]
)
def test_buffers_in_data_uris_of_any_media_type(plain: Path, tmp_path: Path, media: str) -> None:
    same_surface(plain, as_text(plain, tmp_path / "a.gltf", media))


def test_a_byte_order_mark_is_stepped_over(plain: Path, tmp_path: Path) -> None:
    same_surface(plain, as_text(plain, tmp_path / "a.gltf", bom=b"\xef\xbb\xbf"))


def test_a_data_uri_that_is_none_is_named(plain: Path, tmp_path: Path) -> None:
    path = as_text(plain, tmp_path / "a.gltf")
    path.write_text(path.read_text().replace("base64,", "base64,?!"))
    with pytest.raises(InputError, match=r"a\.gltf: buffer 0"):
        load_rig(path)


def other_scene(content: dict) -> None:
    content["nodes"].append({"name": "LOD1", "mesh": 0, "skin": 0})
    content["scenes"].append({"nodes": [len(content["nodes"]) - 1]})


def test_only_the_default_scene_counts(plain: Path, tmp_path: Path) -> None:
    path = edit(plain, tmp_path / "a.glb", other_scene)
    same_surface(plain, path)
    assert any("left out: LOD1" in note for note in load_rig(path).notes)
    # where it shows nothing that has a skin, all do
    empty = edit(path, tmp_path / "b.glb", lambda g: (g["scenes"].append({"nodes": []}), g.update(scene=2)))
    assert any("shows no skinned mesh" in note for note in load_rig(empty).notes)
    with pytest.raises(InputError, match="default scene 9 does not exist"):
        load_rig(edit(path, tmp_path / "c.glb", lambda g: g.update(scene=9)))


@pytest.mark.parametrize("where", ["mesh", "node"])
def test_default_morph_weights_count(tmp_path: Path, where: str) -> None:
    what = animal()
    shift = np.zeros_like(what.vertices)
    shift[:100, 1] = 0.02
    path = write(tmp_path / "a.glb", what, {})
    gltf = gl.GLTF2().load(str(path))
    data = np.ascontiguousarray(shift, "<f4").tobytes()
    gltf.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(gltf.binary_blob()), byteLength=len(data)))
    gltf.accessors.append(
        gl.Accessor(bufferView=len(gltf.bufferViews) - 1, componentType=gl.FLOAT, count=len(shift), type="VEC3")
    )
    gltf.meshes[0].primitives[0].targets = [{"POSITION": len(gltf.accessors) - 1}] * 2
    gltf.set_binary_blob(gltf.binary_blob() + data)
    gltf.buffers[0].byteLength = len(gltf.binary_blob())
    gltf.save_binary(str(path))
    weighted = edit(
        path,
        tmp_path / "b.glb",
        lambda g: (g["meshes"][0] if where == "mesh" else g["nodes"][-1]).update(weights=[0.5, 1.0]),
    )
    got = load_rig(weighted).surface
    np.testing.assert_allclose(got.to_source(got.vertices), what.vertices + 1.5 * shift, atol=CLOSE)
    same_surface(path, edit(path, tmp_path / "c.glb", lambda g: g["meshes"][0].update(weights=[0.0, 0.0])))
    with pytest.raises(InputError, match="2 morph targets, but 1 weights"):
        load_rig(edit(path, tmp_path / "d.glb", lambda g: g["meshes"][0].update(weights=[1.0])))


def bare(what: Skinned, vertices: list[int]) -> Skinned:
    weights = what.weights.copy()
    weights[vertices] = 0.0
    return Skinned(what.names, what.parents, what.offsets, what.turns, what.vertices, what.faces, what.joints, weights)


def test_vertices_without_weight_follow_their_neighbours(tmp_path: Path) -> None:
    what = animal()
    inside = [int(v) for v in np.flatnonzero((what.weights[:, 0] > 0.999) & (what.joints[:, 0] == 7))[:5]]
    rig = load_rig(write(tmp_path / "a.glb", bare(what, inside), {}))
    assert any("5 vertices without any weight" in note for note in rig.notes)
    assert rig.skin is not None
    owners = {rig.skeleton.names[j] for v in inside for j in rig.skin.joints[rig.surface.weld[v]]}
    assert owners == {"brush2"}
    np.testing.assert_allclose(rig.skin.weights.sum(axis=1), 1, atol=1e-12)


def test_transforms_that_mirror_turn_faces_over(tmp_path: Path) -> None:
    mirrored = write(tmp_path / "a.glb", animal(), {}, armature={"scale": [1.0, 1.0, -1.0]})
    rig = load_rig(mirrored)
    corners = rig.surface.vertices[rig.surface.faces]
    volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume > 0


def test_meshes_that_hang_on_a_joint_are_rigid(plain: Path, tmp_path: Path) -> None:
    def horn(content: dict) -> None:
        content["nodes"].append({"name": "horn", "mesh": 1})
        content["meshes"].append({"name": "horn", "primitives": [{"attributes": {"POSITION": 0}, "indices": 3}]})
        content["nodes"][3]["children"].append(len(content["nodes"]) - 1)

    rig = load_rig(edit(plain, tmp_path / "a.glb", horn))
    assert rig.rigid is not None
    names = np.array([*rig.skeleton.names, "-"])[rig.rigid]
    assert set(names[rig.surface.weld[: len(animal().vertices)]]) == {"-"}
    assert set(names[rig.surface.weld[len(animal().vertices) :]]) == {"skull"}
    assert load_rig(plain).rigid is None


def test_texture_coordinates_count_from_below_and_are_transformed(tmp_path: Path) -> None:
    path = write(tmp_path / "a.glb", animal(), {})
    gltf = gl.GLTF2().load(str(path))
    uv = np.random.default_rng(3).random((len(animal().vertices), 2))
    data = np.ascontiguousarray(uv, "<f4").tobytes()
    gltf.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(gltf.binary_blob()), byteLength=len(data)))
    gltf.accessors.append(
        gl.Accessor(bufferView=len(gltf.bufferViews) - 1, componentType=gl.FLOAT, count=len(uv), type="VEC2")
    )
    gltf.meshes[0].primitives[0].attributes.TEXCOORD_0 = len(gltf.accessors) - 1
    gltf.meshes[0].primitives[0].material = 0
    colour = gl.PbrMetallicRoughness(baseColorTexture=gl.TextureInfo(index=0))
    gltf.materials = [gl.Material(pbrMetallicRoughness=colour)]
    gltf.set_binary_blob(gltf.binary_blob() + data)
    gltf.buffers[0].byteLength = len(gltf.binary_blob())
    gltf.save_binary(str(path))
    np.testing.assert_allclose(load_rig(path).surface.uv, np.column_stack([uv[:, 0], 1 - uv[:, 1]]), atol=CLOSE)

    def transformed(content: dict) -> None:
        info = content["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
        info["extensions"] = {"KHR_texture_transform": {"offset": [0.25, 0.5], "scale": [0.5, 0.25]}}
        content["extensionsRequired"] = ["KHR_texture_transform"]

    got = load_rig(edit(path, tmp_path / "b.glb", transformed)).surface.uv
    np.testing.assert_allclose(got, np.column_stack([0.25 + 0.5 * uv[:, 0], 0.5 - 0.25 * uv[:, 1]]), atol=CLOSE)


@pytest.mark.parametrize(
    ("extension", "message"),
    [
        ("EXT_meshopt_compression", "compressed with EXT_meshopt_compression"),
        ("KHR_meshopt_compression", "compressed with KHR_meshopt_compression"),
        ("KHR_draco_mesh_compression", "compressed with KHR_draco_mesh_compression"),
        ("EXT_mesh_gpu_instancing", "requires the extension EXT_mesh_gpu_instancing"),
        ("ACME_codec", "requires the extension ACME_codec"),
        ("KHR_materials_unlit", None),
        ("KHR_mesh_quantization", None),
        ("EXT_texture_webp", None),
        ("VRMC_vrm", None),
    ],
)
def test_required_extensions_are_known_or_named(
    plain: Path, tmp_path: Path, extension: str, message: str | None
) -> None:
    path = edit(plain, tmp_path / "a.glb", lambda g: g.update(extensionsRequired=[extension]))
    if message is None:
        same_surface(plain, path)
        return
    for read in (load_rig, animation_names):
        with pytest.raises(InputError, match=message) as caught:
            read(path)
        assert "\n" not in str(caught.value)


def test_buffers_that_only_meshopt_can_fill_are_named(plain: Path, tmp_path: Path) -> None:
    def packed(content: dict) -> None:
        content["buffers"].append({"byteLength": 10, "extensions": {"EXT_meshopt_compression": {"fallback": True}}})
        content["bufferViews"][0] |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": {"buffer": 0}}}

    with pytest.raises(InputError, match="compressed with EXT_meshopt_compression"):
        load_rig(edit(plain, tmp_path / "a.glb", packed))


def test_quantised_positions_are_read(tmp_path: Path) -> None:
    """Integers, normalised and not, which the nodes and inverse bind matrices bring to size."""
    what = animal()
    path = write(tmp_path / "a.glb", what, {})
    for kind, component, normalized in ((np.int16, gl.SHORT, True), (np.uint16, gl.UNSIGNED_SHORT, False)):
        low, high = what.vertices.min(axis=0), what.vertices.max(axis=0)
        step = (high - low).max() / 30000
        stored = np.round((what.vertices - low) / step).astype(kind)
        data = np.zeros((len(stored), 4), kind)
        data[:, :3] = stored
        gltf = gl.GLTF2().load(str(path))
        raw = data.tobytes()
        gltf.bufferViews.append(
            gl.BufferView(buffer=0, byteOffset=len(gltf.binary_blob()), byteLength=len(raw), byteStride=8)
        )
        view = len(gltf.bufferViews) - 1
        # the matrix that turns stored numbers into metres goes before the inverse bind matrices
        dequantise = np.diag([*[step * (32767 if normalized else 1)] * 3, 1.0])
        dequantise[:3, 3] = low
        inverse = (np.linalg.inv(what.frames()) @ dequantise).swapaxes(1, 2).astype("<f4").tobytes()
        offset = len(gltf.binary_blob()) + len(raw)
        gltf.bufferViews.append(gl.BufferView(buffer=0, byteOffset=offset, byteLength=len(inverse)))
        accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes.POSITION]
        accessor.bufferView, accessor.componentType, accessor.normalized = view, component, normalized
        gltf.accessors[gltf.skins[0].inverseBindMatrices].bufferView = view + 1
        gltf.set_binary_blob(gltf.binary_blob() + raw + inverse)
        gltf.buffers[0].byteLength = len(gltf.binary_blob())
        gltf.extensionsRequired = ["KHR_mesh_quantization"]
        gltf.save_binary(str(tmp_path / "q.glb"))
        got = load_rig(tmp_path / "q.glb").surface
        np.testing.assert_allclose(got.to_source(got.vertices), what.vertices, atol=step)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"asset": {"version": "1.0"}, "meshes": {}}', "is glTF 1.0"),
        ('{"meshes": {"a": {}}, "nodes": {}}', "is glTF 1.0"),
        ('{"asset": {"version": "3.0"}}', "no asset version 2"),
        ('{"asset": ' + "[" * 100_000, "JSON: 100,001 levels; the limit is 200"),
        ("[1]", "neither binary nor JSON"),
    ],
    ids=["1.0", "1.0 without asset", "3.0", "deep", "a list"],
)
def test_what_is_no_gltf_2_is_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        load_rig(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda g: g["bufferViews"][0].update(byteStride=-4096), "byteStride wants a whole number from 0 on"),
        (lambda g: g["bufferViews"][0].update(byteOffset=-16), "byteOffset wants a whole number from 0 on"),
        (lambda g: g["accessors"][0].update(count=-1), "count wants a whole number from 0 on"),
        (
            lambda g: (g["accessors"][0].update(count=10**9), g["accessors"][0].pop("bufferView")),
            "1,000,000,000 vertices; the limit is",
        ),
        (lambda g: g["accessors"][3].update(componentType=5126), "unsigned integers|needs bytes"),
        (lambda g: g["nodes"][-1].update(mesh=7), "mesh 7 does not exist"),
    ],
)
def test_numbers_that_point_elsewhere_are_named(plain: Path, tmp_path: Path, change: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_rig(edit(plain, tmp_path / "a.glb", change))


@pytest.mark.parametrize("sided", [False, True])
def test_a_mirrored_hand_is_the_other_one(write_glb, hand_glb, tmp_path: Path, sided: bool) -> None:
    """A right hand under a node that mirrors is a left hand and bends as one, whatever its names say."""
    glb = hand_glb("right", names=lambda name: name if sided else name.replace("right.", ""))
    right = load_rig(write_glb(glb, tmp_path / "right.glb"))
    left = load_rig(
        edit(
            write_glb(glb, tmp_path / "plain.glb"),
            tmp_path / "left.glb",
            lambda g: next(n for n in g["nodes"] if n["name"] == "Armature").update(scale=[-1.0, 1.0, 1.0]),
        )
    )
    mirror = np.array([-1.0, 1.0, 1.0])
    assert left.skeleton.names == tuple(name.replace("right.", "left.") for name in right.skeleton.names)
    np.testing.assert_allclose(left.skeleton.rest * mirror, right.skeleton.rest, atol=1e-5)
    np.testing.assert_allclose(-left.skeleton.axes * mirror, right.skeleton.axes, atol=1e-4)
    np.testing.assert_array_equal(left.surface.faces[:, ::-1], right.surface.faces)
    from warpjld.covering import bind
    from warpjld.skeleton import poses_from_angles

    moved = []
    for rig in (right, left):
        angles = np.zeros((1, len(rig.skeleton), 4))
        angles[0, [j for j, n in enumerate(rig.skeleton.names) if "knuckle" in n or "base" in n], 0] = 0.5
        moved.append(bind(rig.skeleton, rig.surface).deform(poses_from_angles(rig.skeleton, angles))[0])
    np.testing.assert_allclose(moved[1] * mirror, moved[0], atol=1e-4 * right.surface.size)
