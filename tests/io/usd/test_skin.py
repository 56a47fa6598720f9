"""UsdSkel rigs read from stages written here, against the same arrays read as glTF."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.io.usd.stages import Keys, Stage, instanced, transform
from warpjld.errors import InputError, MissingExtraError
from warpjld.io import load_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.io.source import SourceRig
from warpjld.io.usd.skin import read_usd_rig
from warpjld.rig import Rig

pytest.importorskip("pxr")

# asked for; both files hold float32
POSITION, ROTATION = 1e-6, 1e-5

SUFFIXES = ("usd", "usda", "usdc")


@pytest.fixture(scope="module")
def hand(hand_glb: Callable[..., object]) -> Stage:
    """The built-in left hand."""
    return stage_of(hand_glb(names=plain_name))


def plain_name(name: str) -> str:
    """USD's joint names are paths: no dots."""
    return name.replace(".", "_")


def stage_of(glb: object) -> Stage:
    return Stage(glb.names, glb.parents, glb.frames, glb.vertices, glb.faces, glb.joints, glb.weights)


def dense(rig: SourceRig) -> np.ndarray:
    out = np.zeros((len(rig.vertices), len(rig.tree)))
    np.add.at(out, (np.arange(len(out))[:, None], rig.joints), rig.weights)
    return out


def same(usd: SourceRig, gltf: SourceRig, place: np.ndarray | None = None) -> None:
    """The same rig, the USD one moved by ``place``; whatever the order of the joints."""
    place = np.eye(4) if place is None else place
    assert set(usd.tree.names) == set(gltf.tree.names)
    order = [usd.tree.names.index(name) for name in gltf.tree.names]
    frames = place @ gltf.tree.frames
    np.testing.assert_allclose(usd.tree.frames[order][:, :3, 3], frames[:, :3, 3], atol=POSITION)
    np.testing.assert_allclose(usd.tree.frames[order][:, :3, :3], frames[:, :3, :3], atol=ROTATION)
    back = np.argsort(order)
    parents = usd.tree.parents[order]
    np.testing.assert_array_equal(np.where(parents < 0, -1, back[parents]), gltf.tree.parents)
    np.testing.assert_allclose(usd.vertices, gltf.vertices @ place[:3, :3].T + place[:3, 3], atol=POSITION)
    np.testing.assert_array_equal(usd.faces, gltf.faces)
    np.testing.assert_allclose(dense(usd)[:, order], dense(gltf), atol=1e-6)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_rig_as_gltf(
    write_glb: Callable, hand_glb: Callable, hand: Stage, tmp_path: Path, suffix: str
) -> None:
    gltf = write_glb(hand_glb(names=plain_name), tmp_path / "a.glb")
    usd = hand.write(tmp_path / f"a.{suffix}")
    theirs, ours = read_gltf_rig(gltf), read_usd_rig(usd)
    # the test's GLB writer drops nothing and keeps the order of vertices
    same(ours, theirs)
    assert ours.notes == ()
    rigs = load_rig(gltf), load_rig(usd)
    assert rigs[0].skeleton.names == rigs[1].skeleton.names
    np.testing.assert_allclose(rigs[1].skeleton.rest, rigs[0].skeleton.rest, atol=POSITION)
    np.testing.assert_allclose(rigs[1].skeleton.axes, rigs[0].skeleton.axes, atol=ROTATION)
    np.testing.assert_allclose(rigs[1].surface.vertices, rigs[0].surface.vertices, atol=POSITION)


def test_usdz_is_read(hand: Stage, tmp_path: Path) -> None:
    from pxr import UsdUtils

    hand.write(tmp_path / "a.usdc")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usdc"), str(tmp_path / "a.usdz"))
    same(read_usd_rig(tmp_path / "a.usdz"), read_usd_rig(tmp_path / "a.usdc"))


@pytest.mark.parametrize(("metres", "up"), [(0.01, "Y"), (0.001, "Z"), (1.0, "Z"), (0.0254, "Y")])
def test_the_stage_says_its_unit_and_up_axis(hand: Stage, tmp_path: Path, metres: float, up: str) -> None:
    """A hand is turned on its side by upAxis alone: a single hand's direction says nothing."""
    to_stage = transform(scale=1 / metres) @ (transform(turn=(np.pi / 2, 0, 0)) if up == "Z" else np.eye(4))
    frames = to_stage @ hand.frames
    frames[:, :3, :3] *= metres
    own = replace(hand, frames=frames, vertices=hand.vertices @ to_stage[:3, :3].T, metres=metres, up=up)
    plain = load_rig(hand.write(tmp_path / "a.usda"))
    placed = load_rig(own.write(tmp_path / "b.usda"))
    np.testing.assert_allclose(placed.surface.vertices, plain.surface.vertices, atol=POSITION)
    np.testing.assert_allclose(placed.skeleton.rest, plain.skeleton.rest, atol=POSITION)
    np.testing.assert_allclose(placed.skeleton.axes, plain.skeleton.axes, atol=ROTATION)
    np.testing.assert_allclose(placed.placing, np.linalg.inv(to_stage), atol=1e-9)
    assert placed.suspicious == ()
    # what the user says goes first, and an implausible size is told
    assert load_rig(tmp_path / "b.usda", unit="m").surface.size == pytest.approx(plain.surface.size / metres)
    wrong = load_rig(replace(own, metres=100 * metres).write(tmp_path / "c.usda"))
    assert "plausible" in wrong.suspicious[0]


def test_without_a_unit_it_is_guessed(hand: Stage, tmp_path: Path) -> None:
    """metersPerUnit falls back to centimetres where a stage does not say: a hand in metres stays one."""
    rig = load_rig(replace(hand, metres=None, up=None).write(tmp_path / "a.usda"))
    np.testing.assert_allclose(rig.surface.vertices, hand.vertices, atol=POSITION)


def test_places_and_bind_transforms(hand: Stage, tmp_path: Path) -> None:
    """geomBindTransform, a moved SkelRoot, the mesh's own order of joints: all as the formula has them."""
    plain = read_usd_rig(hand.write(tmp_path / "a.usda"))
    bind = transform((0.1, 0.2, 0.3), (0.3, -0.2, 0.9), 0.5)
    place = transform((1.0, -2.0, 0.5), (0.4, 0.8, -0.1))
    order = np.random.default_rng(3).permutation(len(hand.names)).tolist()
    points = hand.vertices @ np.linalg.inv(bind)[:3, :3].T + np.linalg.inv(bind)[:3, 3]
    moved = replace(hand, vertices=points, geom_bind=bind, place=place, mesh_joints=order)
    same(read_usd_rig(moved.write(tmp_path / "b.usda")), plain, place)
    # bindTransforms in the world, as USD's documentation words it, restTransforms in the skeleton
    world = replace(moved, frames=place @ hand.frames, rest=hand.frames, geom_bind=place @ bind)
    same(read_usd_rig(world.write(tmp_path / "c.usda")), plain, place)


def test_rest_transforms_stand_in_for_missing_bind_transforms(hand: Stage, tmp_path: Path) -> None:
    rig = read_usd_rig(replace(hand, with_bind=False).write(tmp_path / "a.usda"))
    same(rig, read_usd_rig(hand.write(tmp_path / "b.usda")))
    assert any("no bindTransforms" in note for note in rig.notes)


def test_winding(hand: Stage, tmp_path: Path) -> None:
    """Left-handed orientation and a mirroring transform each turn triangles over; both together do not."""
    plain = read_usd_rig(hand.write(tmp_path / "a.usda"))
    flipped = replace(hand, faces=np.asarray(hand.faces)[:, ::-1], left_handed=True)
    np.testing.assert_array_equal(read_usd_rig(flipped.write(tmp_path / "b.usda")).faces, plain.faces)
    mirror = np.diag([-1.0, 1, 1, 1])
    mirrored = replace(hand, vertices=hand.vertices * [-1, 1, 1], geom_bind=mirror)
    rig = read_usd_rig(mirrored.write(tmp_path / "c.usda"))
    np.testing.assert_allclose(rig.vertices, plain.vertices, atol=1e-7)
    assert signed_volume(rig) == pytest.approx(-signed_volume(plain), rel=1e-5)
    both = replace(mirrored, left_handed=True)
    assert signed_volume(read_usd_rig(both.write(tmp_path / "d.usda"))) == pytest.approx(signed_volume(plain), rel=1e-5)


def signed_volume(rig: SourceRig) -> float:
    a, b, c = rig.vertices[rig.faces.T] - rig.vertices.mean(axis=0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)))


def bar(**changes: object) -> Stage:
    """Two joints along x and a bar of square section around them, of six quads."""
    corners = np.array([[x, y, z] for x in (0.0, 2.0) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    frames = np.stack([transform(), transform((1.0, 0, 0))])
    joints, weights = np.tile([0, 1], (8, 1)), np.where(corners[:, :1] < 1.0, [1.0, 0.0], [0.25, 0.75])
    return replace(Stage(["root", "end"], [-1, 0], frames, corners, quads, joints, weights), **changes)


def test_quads_holes_and_concave_faces(tmp_path: Path) -> None:
    rig = read_usd_rig(bar().write(tmp_path / "a.usda"))
    assert len(rig.faces) == 12
    assert signed_volume(rig) / 6 == pytest.approx(2 * 0.2 * 0.2, rel=1e-6)
    assert len(read_usd_rig(bar(holes=[1]).write(tmp_path / "b.usda")).faces) == 10
    arrow = np.array([[0, 0, 0], [2, 0, 0], [0.2, 0.2, 0], [0, 2, 0.0]])
    flat = replace(bar(), vertices=np.vstack([arrow, arrow + np.array([0, 0, 1])]), faces=[[1, 2, 3, 0], [4, 5, 6, 7]])
    rig = read_usd_rig(flat.write(tmp_path / "c.usda"))
    area = np.cross(*(rig.vertices[rig.faces[:, k]] - rig.vertices[rig.faces[:, 0]] for k in (1, 2)))[:, 2] / 2
    np.testing.assert_allclose(area.sum(), 2 * 0.4, rtol=1e-6)
    assert (area > 0).all()


def test_texture_coordinates(tmp_path: Path) -> None:
    """By vertex, indexed, or by corner; by vertex in any case where all corners of a vertex agree."""
    uv = np.random.default_rng(1).random((8, 2)).astype(np.float32)
    corners = np.ravel(bar().faces)
    by_vertex = bar(uv=uv)
    np.testing.assert_array_equal(read_usd_rig(by_vertex.write(tmp_path / "a.usda")).uv, uv)
    indexed = bar(uv=uv[::-1], uv_indices=np.arange(8)[::-1])
    np.testing.assert_array_equal(read_usd_rig(indexed.write(tmp_path / "b.usda")).uv, uv)
    by_corner = bar(uv=uv[corners], uv_interpolation="faceVarying")
    np.testing.assert_array_equal(read_usd_rig(by_corner.write(tmp_path / "c.usda")).uv, uv)
    indexed = bar(uv=uv, uv_interpolation="faceVarying", uv_indices=corners)
    np.testing.assert_array_equal(read_usd_rig(indexed.write(tmp_path / "d.usda")).uv, uv)
    torn = bar(uv=np.arange(48).reshape(24, 2), uv_interpolation="faceVarying")
    rig = read_usd_rig(torn.write(tmp_path / "e.usda"))
    assert rig.uv is None
    assert rig.corner_uv is not None
    assert len(rig.vertices) == 8
    place = dict(zip(map(tuple, rig.corner_uv.reshape(-1, 2)), rig.faces.ravel(), strict=False))
    assert place == {(2.0 * c, 2.0 * c + 1.0): corner for c, corner in enumerate(corners)}


def test_constant_influences_are_rigid(tmp_path: Path) -> None:
    rigid = bar(constant=True, joints=np.array([[1]]), weights=np.array([[1.0]]))
    rig = read_usd_rig(rigid.write(tmp_path / "a.usda"))
    np.testing.assert_array_equal(rig.rigid, np.ones(8))
    np.testing.assert_array_equal(dense(rig), np.tile([0.0, 1.0], (8, 1)))
    shared = bar(constant=True, joints=np.array([[0, 1]]), weights=np.array([[0.25, 0.75]]))
    rig = read_usd_rig(shared.write(tmp_path / "b.usda"))
    np.testing.assert_array_equal(rig.rigid, -np.ones(8))
    np.testing.assert_allclose(dense(rig), np.tile([0.25, 0.75], (8, 1)))


def test_blend_shapes_at_their_default_weights(tmp_path: Path) -> None:
    offsets = np.zeros((8, 3))
    offsets[2:5] = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]]
    keys = [Keys([0], np.zeros((1, 2, 3)), np.tile([0, 0, 0, 1.0], (1, 2, 1)))]
    half = bar(shapes={"smile": (offsets, 0.5), "other": (-offsets, 0.0)}, keys=keys)
    rig = read_usd_rig(half.write(tmp_path / "a.usda"))
    np.testing.assert_allclose(rig.vertices, bar().vertices + 0.5 * offsets, atol=1e-6)
    moving = bar(shapes={"smile": (offsets, None)}, keys=keys)
    rig = read_usd_rig(moving.write(tmp_path / "b.usda"))
    np.testing.assert_allclose(rig.vertices, bar().vertices, atol=1e-6)
    assert any("blend shapes move" in note for note in rig.notes)


def test_instances_of_one_rig(hand: Stage, tmp_path: Path) -> None:
    """Each instance stands where it was placed, with joints of its own; names say which is whose."""
    places = {"A": transform((0.5, 0, 0)), "B": transform((-0.5, 0, 0), (0, 1.0, 0))}
    plain = read_usd_rig(hand.write(tmp_path / "a.usda"))
    rig = read_usd_rig(instanced(hand, tmp_path / "b.usda", places))
    count, size = len(plain.tree), len(plain.vertices)
    assert rig.tree.names == tuple(f"{place}/{name}" for place in "AB" for name in plain.tree.names)
    for i, place in enumerate(places.values()):
        frames, vertices = rig.tree.frames[i * count :][:count], rig.vertices[i * size :][:size]
        np.testing.assert_allclose(frames, place @ plain.tree.frames, atol=POSITION)
        np.testing.assert_allclose(vertices, plain.vertices @ place[:3, :3].T + place[:3, 3], atol=POSITION)
        np.testing.assert_array_equal(rig.faces[i * len(plain.faces) :][: len(plain.faces)] - i * size, plain.faces)
    np.testing.assert_array_equal(np.unique(rig.joints[size:]), np.unique(plain.joints) + count)


def test_joints_of_one_name_are_told_apart(tmp_path: Path) -> None:
    frames = np.stack([transform((float(x), 0, 0)) for x in range(5)])
    stage = bar()
    stage = replace(stage, names=["hip", "left", "foot", "right", "foot"], parents=[-1, 0, 1, 0, 3], frames=frames)
    assert read_usd_rig(stage.write(tmp_path / "a.usda")).tree.names == (
        "hip", "left", "left/foot", "right", "right/foot"
    )  # fmt: skip


def test_vertices_without_weight_follow_the_nearest(tmp_path: Path) -> None:
    weights = bar().weights.copy()
    weights[7] = 0.0
    rig = read_usd_rig(bar(weights=2 * weights).write(tmp_path / "a.usda"))
    np.testing.assert_allclose(rig.weights[7], rig.weights[6])
    np.testing.assert_allclose(rig.weights.sum(axis=1), 1.0, atol=1e-12)
    assert any("1 vertices have no weight" in note for note in rig.notes)


def test_what_does_not_belong_is_left_out(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    path = bar().write(tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(path))
    UsdGeom.Mesh.Define(stage, "/World/Rig/Loose").CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    for name in ("Hidden", "Guide"):
        copy = stage.DefinePrim(f"/World/Rig/{name}")
        copy.GetReferences().AddInternalReference("/World/Rig/Mesh")
        mesh = UsdGeom.Mesh(copy)
        if name == "Hidden":
            mesh.MakeInvisible()
        if name == "Guide":
            mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)
    stage.Save()
    del stage
    rig = read_usd_rig(path)
    assert [part.name for part in rig.parts] == ["Mesh"]
    assert len(rig.vertices) == 8
    assert sorted(note.split("'")[1].split("/")[-1] for note in rig.notes) == ["Guide", "Hidden", "Loose"]


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (bar(joints=None), "no visible mesh uses its skeleton"),
        (bar(with_mesh=False), "no visible mesh uses its skeleton"),
        (bar(joints=np.tile([0, 7], (8, 1))), "vertex 4 follows joint 7, there are 2"),
        (bar(joints=np.tile([0, -7], (8, 1))), "vertex 4 follows joint"),
        (bar(weights=np.full((8, 2), -1.0)), "negative or non-finite weight"),
        (bar(weights=np.zeros((8, 2))), "no vertex has any weight"),
        (bar(joints=np.zeros((7, 2)), weights=np.ones((7, 2))), "14 joint indices and 14 weights are not 2 for"),
        (bar(vertices=np.full((8, 3), np.nan)), "vertex 0 is not finite"),
        (bar(faces=[[0, 1, 9]]), "face index 9 is beyond its 8 vertices"),
        (bar(frames=np.full((2, 4, 4), np.nan), rest=np.tile(np.eye(4), (2, 1, 1))), "is not finite"),
        (bar(metres=-1.0), "metersPerUnit"),
        (bar(names=["a", "a"], parents=[-1, -1]), "two joints 'a'"),
        (bar(names=[], parents=[], frames=np.zeros((0, 4, 4))), "no joints"),
    ],
)  # fmt: skip
def test_broken_stages_are_named(tmp_path: Path, capfd: pytest.CaptureFixture, broken: Stage, message: str) -> None:
    path = broken.write(tmp_path / "a.usda")
    with pytest.raises(InputError, match=message) as caught:
        load_rig(path)
    assert caught.value.path == path
    assert "\n" not in caught.value.message
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("garbage", "not a valid usda layer"),
        ("#usda 1.0\ndef Xform \"a\" {", "OpenUSD cannot read it"),
        ("#usda 1.0\n(subLayers = [@nowhere.usda@])\n", "nowhere.usda"),
        ("#usda 1.0\ndef \"a\" (references = @nowhere.usda@) {}\n", "nowhere.usda"),
        ("#usda 1.0\ndef Mesh \"a\" {}\n", "has no joints: give a skeleton file"),
        ("", "OpenUSD cannot read it"),
        ("#usda 1.0\ndef Skeleton \"a\" { nonsense[] joints = [] }\n", "OpenUSD cannot read it"),
        ("#usda 1.0\ndef Skeleton \"a\" {\n uniform int joints = 3\n}\n", "not of the type that UsdSkel wants"),
    ],
)  # fmt: skip
def test_what_is_no_stage_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture, text: str, message: str) -> None:
    path = tmp_path / "a.usda"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_rig(path)
    assert "\n" not in caught.value.message
    assert capfd.readouterr().err == ""


def test_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match=r"warpjld\[usd\]"):
        load_rig(tmp_path / "a.usda")


REAL = [
    "hand_webxr_generic/left.glb",
    "hand_anny/right.glb",
    "hand_godot_low/Hand_low_L.gltf",
    "body_anny/body_lowpoly_163joints.glb",
    "body_mesh2motion_mannequin/human-male.glb",
]


@pytest.mark.parametrize("name", REAL)
def test_real_rigs_converted(data: Path, tmp_path: Path, name: str) -> None:
    """Read as glTF, written as USD in centimetres, read again."""
    rig = read_gltf_rig(data / name)
    scale = transform(scale=100.0)
    order = sorted(range(len(rig.tree)), key=rig.tree.depth)  # UsdSkel wants parents first
    place = np.argsort(order)
    names = [rig.tree.names[j].replace("/", "_") for j in order]
    usd = Stage(
        names,
        [-1 if (p := rig.tree.parents[j]) < 0 else int(place[p]) for j in order],
        (scale @ rig.tree.frames)[order],
        100 * rig.vertices,
        rig.faces,
        place[rig.joints],
        rig.weights,
        metres=0.01,
    )
    read = read_usd_rig(usd.write(tmp_path / "a.usdc"))
    size = np.linalg.norm(np.ptp(rig.vertices, axis=0))
    np.testing.assert_allclose(read.vertices / 100, rig.vertices, atol=POSITION * max(size, 1.0))
    np.testing.assert_array_equal(read.faces, rig.faces)
    np.testing.assert_allclose(dense(read), dense(rig)[:, order], atol=1e-6)
    np.testing.assert_allclose(read.tree.frames, (scale @ rig.tree.frames)[order], atol=1e-9 * 100)
    loaded, theirs = load_rig(tmp_path / "a.usdc"), load_rig(data / name)
    assert set(loaded.skeleton.names) == set(theirs.skeleton.names)
    rest = [loaded.skeleton.rest[loaded.skeleton.index(one)] for one in theirs.skeleton.names]
    factor = loaded.placing[0, 0] * 100 / theirs.placing[0, 0]
    np.testing.assert_allclose(rest, factor * theirs.skeleton.rest, atol=2 * POSITION)


def test_a_rig_is_a_rig(hand: Stage, tmp_path: Path) -> None:
    rig = load_rig(hand.write(tmp_path / "a.usda"))
    assert isinstance(rig, Rig)
    assert rig.source is not None
    assert len(rig.source) == len(hand.names)
