"""FBX rigs and animations, against the same rig written as GLB, and against the arrays both were written from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.glb_files import Glb
from tests.io.fbx_text import Fbx, Mesh
from warpjld.errors import InputError, MissingExtraError
from warpjld.io import load_rig
from warpjld.io.fbx.rig import read_fbx_rig
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.io.source import SourceRig
from warpjld.motion.fbx_animation import fbx_animation_names, read_fbx_animation
from warpjld.motion.load import load_motion
from warpjld.runtime.separate_process import end_process

pytest.importorskip("ufbx")

PLACE, TURN = 1e-6, 1e-5  # what the reading is held to: metres, and entries of rotation matrices


@pytest.fixture(scope="module")
def hand(hand_glb: Callable[..., Glb]) -> Glb:
    """The built-in hand with frames whose axes lie anyhow."""
    return hand_glb("left")


def as_fbx(glb: Glb, **more: object) -> Fbx:
    mesh = Mesh("skin", glb.vertices, glb.faces.tolist(), glb.joints, glb.weights, node=_anywhere())
    content: dict[str, object] = {"names": glb.names, "parents": glb.parents, "frames": glb.frames, "meshes": [mesh]}
    return Fbx(**(content | more))  # type: ignore[arg-type]


def _anywhere() -> np.ndarray:
    node = np.eye(4)
    node[:3, :3] = Rotation.from_euler("xyz", [20.0, -50.0, 110.0], degrees=True).as_matrix() * 1.7
    node[:3, 3] = 0.3, -0.2, 0.5
    return node


def moved(glb: Glb, frames: int = 6) -> np.ndarray:
    """World transforms of an animation: every joint turns about its own axis, the root also travels."""
    local = np.array(
        [np.linalg.inv(glb.frames[p]) @ f if p >= 0 else f for f, p in zip(glb.frames, glb.parents, strict=True)]
    )
    worlds = np.empty((frames, *local.shape))
    random = np.random.default_rng(5)
    axes = random.normal(size=(len(local), 3))
    axes *= random.uniform(0.2, 0.7, (len(local), 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    for f in range(frames):
        for j, parent in enumerate(glb.parents):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(axes[j] * f / (frames - 1)).as_matrix()
            own = local[j] @ turn
            if parent < 0:
                own[:3, 3] += 0.05 * f
            worlds[f, j] = own if parent < 0 else worlds[f, parent] @ own
    return worlds


def dense(rig: SourceRig) -> np.ndarray:
    out = np.zeros((len(rig.vertices), len(rig.tree)))
    assert rig.joints is not None
    assert rig.weights is not None
    np.add.at(out, (np.arange(len(out))[:, None], rig.joints), rig.weights)
    return out


def from_lowest(faces: np.ndarray) -> np.ndarray:
    """Triangles that start at their lowest vertex."""
    return np.take_along_axis(faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)


VARIETY = [
    # unit [cm], up, rotation order, pre- and post-rotation
    (1.0, "y", 0, False),
    (2.54, "z", 1, True),
    (100.0, "x", 3, True),
    (0.1, "-z", 4, True),
    (1.0, "y, facing x", 5, True),
    (30.48, "left-handed", 5, False),
]


@pytest.mark.parametrize(("unit", "up", "order", "turned"), VARIETY)
def test_the_same_rig_and_animation_as_glb(
    hand: Glb, write_glb: Callable[[Glb, Path], Path], tmp_path: Path, unit: float, up: str, order: int, turned: bool
) -> None:
    count = len(hand.names)
    random = np.random.default_rng(order)
    pre = random.uniform(-80, 80, (count, 3)) if turned else None
    post = random.uniform(-80, 80, (count, 3)) if turned else None
    worlds = moved(hand)
    orders = [(order + j) % 6 for j in range(count)]
    fbx = as_fbx(hand, unit=unit, up=up, orders=orders, pre=pre, post=post, stacks={"wave": worlds})
    path = fbx.write(tmp_path / "hand.fbx")
    read, expected = read_fbx_rig(path), read_gltf_rig(write_glb(hand, tmp_path / "hand.glb"))
    assert read.tree.names == expected.tree.names
    np.testing.assert_array_equal(read.tree.parents, expected.tree.parents)
    np.testing.assert_allclose(read.tree.positions, expected.tree.positions, atol=PLACE)
    mirrored = up == "left-handed"  # then the axes of joints are another's convention
    if not mirrored:
        np.testing.assert_allclose(read.tree.frames[:, :3, :3], expected.tree.frames[:, :3, :3], atol=TURN)
    # glTF's writer numbers vertices as its faces use them; the FBX keeps the file's order
    used = np.unique(hand.faces)
    np.testing.assert_allclose(read.vertices[used], expected.vertices, atol=PLACE)
    np.testing.assert_allclose(dense(read)[used], dense(expected), atol=1e-6)
    np.testing.assert_array_equal(from_lowest(read.faces), from_lowest(hand.faces))
    animation = read_fbx_animation(path)
    assert animation.title == "wave"
    assert animation.rate == 30.0
    assert animation.tree.names == read.tree.names
    np.testing.assert_allclose(animation.tree.frames, read.tree.frames, atol=1e-12)
    flesh = animation.worlds @ np.linalg.inv(animation.tree.frames)
    wanted = worlds @ np.linalg.inv(hand.frames)
    np.testing.assert_allclose(animation.worlds[..., :3, 3], worlds[..., :3, 3], atol=PLACE)
    np.testing.assert_allclose(flesh[..., :3, :3], wanted[..., :3, :3], atol=TURN)
    if not mirrored:
        np.testing.assert_allclose(animation.worlds[..., :3, :3], worlds[..., :3, :3], atol=TURN)


def chain(**more: object) -> Fbx:
    """Three joints along x with a rectangular tube of quads on them, a metre each."""
    frames = np.tile(np.eye(4), (3, 1, 1))
    frames[:, 0, 3] = [0.0, 1.0, 2.0]
    frames[:, :3, :3] = Rotation.random(3, rng=4).as_matrix()
    ring = np.array([[0, 0.1, 0.1], [0, -0.1, 0.1], [0, -0.1, -0.1], [0, 0.1, -0.1]])
    vertices = np.concatenate([ring + np.array([x, 0.0, 0.0]) for x in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5)])
    quads = [
        [4 * k + a, 4 * k + 4 + a, 4 * k + 4 + (a + 1) % 4, 4 * k + (a + 1) % 4] for k in range(5) for a in range(4)
    ]
    joints = np.clip(vertices[:, :1].astype(int), 0, 2)
    mesh = Mesh("tube", vertices, [*quads, [0, 1, 2, 3], [23, 22, 21, 20]], joints, np.ones_like(joints, float))
    content: dict[str, object] = {"names": ["a", "b", "c"], "parents": [-1, 0, 1], "frames": frames, "meshes": [mesh]}
    return Fbx(**(content | more))  # type: ignore[arg-type]


def turned(frames: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Another pose of the chain, elsewhere: each joint turned by 40° from the last."""
    world = np.eye(4)
    world[:3, 3] = 0.2, -0.4, 0.6
    out = []
    for j, frame in enumerate(frames):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec([0.0, 0.0, np.radians(40.0)]).as_matrix()
        out.append((world := world @ turn) @ np.diag([scale, scale, scale, 1.0]) @ frame)
        assert j < 3
    return np.array(out)


def test_rest_is_the_bind_pose_whatever_pose_is_shown(tmp_path: Path) -> None:
    fbx = chain()
    plain = read_fbx_rig(fbx.write(tmp_path / "plain.fbx"))
    path = replace(fbx, shown=turned(fbx.frames)).write(tmp_path / "posed.fbx")
    posed = read_fbx_rig(path)
    np.testing.assert_allclose(plain.tree.frames, fbx.frames, atol=PLACE)
    np.testing.assert_allclose(posed.tree.frames, fbx.frames, atol=PLACE)
    np.testing.assert_allclose(posed.vertices, fbx.meshes[0].vertices, atol=PLACE)


def test_a_rig_shown_smaller_than_it_was_bound_has_the_shown_size(tmp_path: Path) -> None:
    fbx = chain()
    rig = read_fbx_rig(replace(fbx, shown=turned(fbx.frames, 0.01)).write(tmp_path / "small.fbx"))
    np.testing.assert_allclose(rig.vertices, 0.01 * fbx.meshes[0].vertices, atol=PLACE)
    np.testing.assert_allclose(rig.tree.positions, 0.01 * fbx.frames[:, :3, 3], atol=PLACE)
    assert any("0.01 times the size" in note for note in rig.notes)


def test_a_rig_shown_elsewhere_in_its_bind_pose_is_where_it_is_shown(tmp_path: Path) -> None:
    fbx = chain()
    away = np.eye(4)
    away[:3, :3] = 0.5 * Rotation.from_euler("x", -90.0, degrees=True).as_matrix()
    away[:3, 3] = 1.0, 2.0, 3.0
    rig = read_fbx_rig(replace(fbx, shown=away @ fbx.frames).write(tmp_path / "away.fbx"))
    expected = fbx.meshes[0].vertices @ away[:3, :3].T + away[:3, 3]
    np.testing.assert_allclose(rig.vertices, expected, atol=PLACE)
    np.testing.assert_allclose(rig.tree.positions, (away @ fbx.frames)[:, :3, 3], atol=PLACE)


@pytest.mark.parametrize("pose", [True, False])
def test_joints_without_a_cluster_are_where_the_bind_pose_has_them(tmp_path: Path, pose: bool) -> None:
    fbx = chain(unbound=frozenset({0, 2}), pose=pose)
    joints = np.ones_like(fbx.meshes[0].joints)
    fbx = replace(fbx, meshes=[replace(fbx.meshes[0], joints=joints)])
    shown = turned(fbx.frames)
    rig = read_fbx_rig(replace(fbx, shown=shown).write(tmp_path / "rig.fbx"))
    expected = fbx.frames if pose else shown
    relative = [np.linalg.inv(frames[1]) @ frames for frames in (rig.tree.frames, expected)]
    np.testing.assert_allclose(relative[0], relative[1], atol=PLACE)


def test_meshes_that_hang_on_joints_are_rigid_and_others_left_out(tmp_path: Path) -> None:
    fbx = chain()
    sphere = np.array([[1.2, 0.3, 0], [1.4, 0.3, 0], [1.2, 0.5, 0], [1.2, 0.3, 0.2]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    eye = Mesh("eye", sphere, faces, node=_anywhere(), parent=1)
    stone = Mesh("stone", sphere, faces)
    rig = read_fbx_rig(
        replace(fbx, meshes=[fbx.meshes[0], eye, stone], shown=turned(fbx.frames)).write(tmp_path / "rig.fbx")
    )
    assert [part.name for part in rig.parts] == ["tube", "eye"]
    part = rig.parts[1]
    np.testing.assert_allclose(rig.vertices[part.vertices], sphere, atol=PLACE)
    assert rig.rigid is not None
    assert (rig.rigid[part.vertices] == 1).all()
    assert (rig.rigid[rig.parts[0].vertices] == -1).all()
    assert any("stone" in note and "left out" in note for note in rig.notes)
    assert load_rig(tmp_path / "rig.fbx").rigid is not None


def test_blend_shapes_count_as_the_file_has_them_set_and_geometry_may_be_displaced(tmp_path: Path) -> None:
    fbx = chain()
    mesh = fbx.meshes[0]
    offsets = np.zeros_like(mesh.vertices)
    offsets[3:9] = np.random.default_rng(0).normal(size=(6, 3))
    shaped = replace(mesh, shapes=[(25.0, offsets), (0.0, 7.0 * offsets)], geometric=(0.3, 0.1, -0.2), node=_anywhere())
    for up in ("y", "z"):
        rig = read_fbx_rig(replace(fbx, meshes=[shaped], up=up).write(tmp_path / f"{up[0]}.fbx"))
        np.testing.assert_allclose(rig.vertices, mesh.vertices + 0.25 * offsets, atol=PLACE)


def test_polygons_of_any_size_keep_their_corners_texture(tmp_path: Path) -> None:
    fbx = chain()
    outline = np.array([[0, 0], [2, 0], [2, 2], [1.9, 0.1], [0.1, 0.1], [0, 2]]) * 0.1  # a U: deeply concave
    plate = np.column_stack([outline, np.zeros(6)])
    mesh = Mesh("plate", plate, [[0, 1, 2, 3, 4, 5]], np.zeros((6, 1), int), np.ones((6, 1)), uv=outline)
    rig = read_fbx_rig(replace(fbx, meshes=[mesh]).write(tmp_path / "plate.fbx"))
    a, b, c = rig.vertices[rig.faces].swapaxes(0, 1)
    areas = 0.5 * np.cross(b - a, c - a)[:, 2]
    x, y = outline.T
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)), abs=1e-9)
    np.testing.assert_allclose(rig.uv, outline, atol=1e-7)


def test_seams_within_vertices_are_kept_by_corner(tmp_path: Path) -> None:
    """A strip of two quads whose shared vertices have other coordinates in each, and a plate without any."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]]) * 0.1
    polygons = [[0, 1, 4, 3], [1, 2, 5, 4]]
    uv = np.random.default_rng(8).random((8, 2)).astype(np.float32)
    bound = np.zeros((6, 1), int), np.ones((6, 1))
    strip = Mesh("strip", points, polygons, *bound, uv=uv)
    plain = Mesh("plain", points + 1.0, polygons, *bound)
    rig = read_fbx_rig(replace(chain(), meshes=[strip, plain]).write(tmp_path / "a.fbx"))
    assert rig.uv is None
    assert len(rig.vertices) == 12
    told = {(v, *np.round(pair, 6)) for v, pair in zip(np.ravel(polygons), uv, strict=True)}
    corners = zip(rig.faces[:4].ravel(), rig.corner_uv[:4].reshape(-1, 2), strict=True)
    assert {(v, *np.round(pair, 6)) for v, pair in corners} == told
    assert not rig.corner_uv[4:].any()
    assert not any("texture" in note for note in rig.notes)


def test_vertices_without_weights_follow_the_nearest(tmp_path: Path) -> None:
    fbx = chain()
    weights = np.ones((24, 1))
    weights[10] = 0.0
    rig = read_fbx_rig(replace(fbx, meshes=[replace(fbx.meshes[0], weights=weights)]).write(tmp_path / "bare.fbx"))
    np.testing.assert_allclose(rig.vertices, fbx.meshes[0].vertices, atol=PLACE)
    np.testing.assert_allclose(dense(rig).sum(axis=1), 1.0)
    assert any("1 vertices have no weight" in note for note in rig.notes)


def test_animations_are_chosen_by_name_and_empty_ones_passed_over(tmp_path: Path) -> None:
    fbx = chain()
    still, near, far = (
        np.tile(fbx.frames, (1, 1, 1, 1)),
        np.tile(fbx.frames, (4, 1, 1, 1)),
        np.tile(fbx.frames, (9, 1, 1, 1)),
    )
    near[:, :, 0, 3] += 0.1 * np.arange(4)[:, None]
    far[:, :, 1, 3] += 0.3 * np.arange(9)[:, None]
    stacks = {"Take 001": still[:0], "pose": still, "near": near, "far": far}
    path = replace(fbx, stacks=stacks, rate=24.0, start=100).write(tmp_path / "takes.fbx")
    assert fbx_animation_names(path) == ("near", "far")
    first, second = read_fbx_animation(path), read_fbx_animation(path, name="far")
    assert first.title == "near"
    assert any("'far'" in note for note in first.notes)
    assert second.title == "far"
    for animation, worlds in ((first, near), (second, far)):
        assert animation.rate == 24.0
        np.testing.assert_allclose(animation.worlds[..., :3, 3], worlds[..., :3, 3], atol=PLACE)
    assert len(read_fbx_animation(path, name="far", rate=48.0)) == 17
    with pytest.raises(InputError, match=r"no animation 'nearly'; it has 'Take 001', 'pose', 'near', 'far'"):
        read_fbx_animation(path, name="nearly")


@pytest.mark.parametrize("rate", [24.0, 29.97, 30.0, 120.0])
def test_the_last_frame_is_there(tmp_path: Path, rate: float) -> None:
    for count in (100, 301):
        fbx = chain()
        worlds = np.tile(fbx.frames, (count, 1, 1, 1))
        worlds[:, :, 0, 3] += 0.01 * np.arange(count)[:, None]
        path = replace(fbx, stacks={"x": worlds}, rate=rate, meshes=fbx.meshes).write(tmp_path / "x.fbx")
        animation = read_fbx_animation(path)
        assert len(animation) == count
        np.testing.assert_allclose(animation.worlds[-1, :, :3, 3], worlds[-1, :, :3, 3], atol=1e-5)


@pytest.mark.parametrize(("stated", "base"), [(23.976, 24), (29.97, 30), (59.94, 60), (119.88, 120)])
def test_broadcast_rates_are_what_their_decimals_round(tmp_path: Path, stated: float, base: int) -> None:
    fbx = chain()
    worlds = np.tile(fbx.frames, (8, 1, 1, 1))
    worlds[:, :, 0, 3] += 0.01 * np.arange(8)[:, None]
    path = replace(fbx, stacks={"x": worlds}, rate=base / 1.001, stated=stated).write(tmp_path / "x.fbx")
    animation = read_fbx_animation(path)
    assert animation.rate == pytest.approx(base / 1.001, rel=1e-12)
    assert len(animation) == 8
    np.testing.assert_allclose(animation.worlds[-1, :, :3, 3], worlds[-1, :, :3, 3], atol=1e-6)


def test_an_animation_without_skin_moves_the_rig_of_another_file(hand: Glb, tmp_path: Path) -> None:
    worlds = moved(hand)
    rig = load_rig(as_fbx(hand, shown=worlds[3]).write(tmp_path / "rig.fbx"))
    bare = as_fbx(hand, stacks={"wave": worlds}, meshes=[], unit=100.0, up="z")
    motion = load_motion(bare.write(tmp_path / "wave.fbx"), rig)
    assert motion.rate == 30.0
    at = [rig.skeleton.names.index(name) for name in hand.names]
    kept = [k for k, j in enumerate(at) if rig.sources[j] >= 0]
    wanted = worlds @ np.linalg.inv(hand.frames)
    rest = np.concatenate([rig.skeleton.rest[[at[k] for k in kept]], np.ones((len(kept), 1))], axis=1)
    expected = np.einsum("fkab,kb->fka", wanted[:, kept], rest)[..., :3]
    np.testing.assert_allclose(motion.poses.positions[:, [at[k] for k in kept]], expected, atol=1e-5)


def test_plain_nodes_are_joints_where_there_are_no_bones(tmp_path: Path) -> None:
    fbx = chain(kinds=["Null", "Null", ""], meshes=[], unbound=frozenset({0, 1, 2}))
    worlds = np.stack([fbx.frames, turned(fbx.frames)])
    animation = read_fbx_animation(replace(fbx, stacks={"x": worlds}).write(tmp_path / "nulls.fbx"))
    assert animation.tree.names == ("a", "b", "c")
    np.testing.assert_allclose(animation.worlds[1], worlds[1], atol=PLACE)


@pytest.mark.parametrize("inherit", [0, 2])
def test_joints_that_do_not_inherit_scale_keep_their_names(tmp_path: Path, inherit: int) -> None:
    fbx = chain(inherit=inherit)
    worlds = np.stack([fbx.frames, turned(fbx.frames)])
    path = replace(fbx, stacks={"x": worlds}).write(tmp_path / "maya.fbx")
    rig, animation = read_fbx_rig(path), read_fbx_animation(path)
    assert rig.tree.names == animation.tree.names == ("a", "b", "c")
    np.testing.assert_allclose(rig.vertices, fbx.meshes[0].vertices, atol=PLACE)
    np.testing.assert_allclose(animation.worlds, worlds, atol=PLACE)


def test_a_joint_scaled_to_nothing_keeps_its_rotation(tmp_path: Path) -> None:
    fbx = chain()
    worlds = np.tile(fbx.frames, (4, 1, 1, 1))
    worlds[2, 2, :3, :3] *= 1e-60  # nothing, as a single float
    path = replace(fbx, stacks={"x": worlds}).write(tmp_path / "flat.fbx")
    animation = read_fbx_animation(path)
    assert any("'c' is scaled to nothing at frame 2" in note for note in animation.warnings)
    turned_by = Rotation.from_matrix(
        animation.worlds[2, 2, :3, :3] / np.cbrt(np.linalg.det(animation.worlds[2, 2, :3, :3]))
    )
    np.testing.assert_allclose(turned_by.as_matrix(), fbx.frames[2, :3, :3], atol=TURN)


BROKEN: dict[str, Callable[[str], bytes]] = {
    "empty": lambda text: b"",
    "no FBX": lambda text: b"solid\nfacet normal 0 0 1\n",
    "cut": lambda text: text[: len(text) // 2].encode(),
    "not a number": lambda text: text.replace("Vertices: *72 {\na: 0", "Vertices: *72 {\na: nan", 1).encode(),
    "a vertex beyond": lambda text: text.replace("a: 0,4,5,-2", "a: 0,400,5,-2", 1).encode(),
    "no bones": lambda text: text.replace('"LimbNode"', '"Null"').replace('"Cluster"', '"Nothing"').encode(),
    "binary": lambda text: b"Kaydara FBX Binary  \x00\x1a\x00\xe8\x1c\x00\x00" + bytes(range(256)) * 4,
}


@pytest.mark.parametrize("what", BROKEN)
def test_broken_files_are_told_in_one_line(tmp_path: Path, what: str) -> None:
    path = tmp_path / "broken.fbx"
    data = BROKEN[what](chain().write(path).read_text())
    assert data != path.read_bytes()
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"broken\.fbx") as caught:
        read_fbx_rig(path)
    assert "\n" not in str(caught.value)


def test_a_file_without_animation_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no animation"):
        read_fbx_animation(chain().write(tmp_path / "still.fbx"))


def _ufbx_that(does: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module in ufbx's place."""
    (folder / "instead" / "ufbx").mkdir(parents=True)
    (folder / "instead" / "ufbx" / "__init__.py").write_text(does)
    monkeypatch.syspath_prepend(folder / "instead")
    end_process()  # the next one has this path


def test_a_reader_that_crashes_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = chain().write(tmp_path / "rig.fbx")
    _ufbx_that("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", tmp_path, monkeypatch)
    with pytest.raises(InputError, match="ends with code -11"):
        read_fbx_rig(path)


def test_without_ufbx_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = chain().write(tmp_path / "rig.fbx")
    monkeypatch.setattr("warpjld.io.fbx.scene.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"warpjld\[fbx\]"):
        load_rig(path)


def test_without_ufbx_that_can_be_imported_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = chain().write(tmp_path / "rig.fbx")
    _ufbx_that("raise ImportError('built for another Python')", tmp_path, monkeypatch)
    with pytest.raises(MissingExtraError, match=r"warpjld\[fbx\]"):
        load_rig(path)


def test_moving_blend_shapes_are_told(tmp_path: Path) -> None:
    fbx = chain()
    offsets = np.full_like(np.asarray(fbx.meshes[0].vertices, dtype=float), 0.01)
    worlds = np.tile(fbx.frames, (5, 1, 1, 1))
    worlds[:, :, 0, 3] += 0.01 * np.arange(5)[:, None]
    shaped = [replace(fbx.meshes[0], shapes=[(0.0, offsets)]), *fbx.meshes[1:]]
    both = replace(fbx, meshes=shaped, stacks={"still": worlds, "speaks": worlds}, shaped=frozenset({"speaks"}))
    path = both.write(tmp_path / "x.fbx")
    assert not read_fbx_animation(path, name="still").warnings
    assert read_fbx_animation(path, name="speaks").warnings == ("the animation of blend shapes is not followed",)


@pytest.mark.parametrize(("blend", "told"), [("Linear", False), ("DualQuaternion", True), ("Blend", True)])
def test_skins_of_dual_quaternions_are_told(tmp_path: Path, blend: str, told: bool) -> None:
    rig = read_fbx_rig(replace(chain(), blend=blend).write(tmp_path / "rig.fbx"))
    assert any("dual quaternions" in note for note in rig.notes) == told


def test_animations_by_the_names_that_people_type(tmp_path: Path) -> None:
    fbx = chain()
    worlds = [np.tile(fbx.frames, (n, 1, 1, 1)) for n in (3, 4, 5)]
    for moving in worlds:
        moving[-1, :, 0, 3] += 0.1
    names = ("Armature|Walk", "Armature|Run", "Prop|Run")
    path = replace(fbx, stacks=dict(zip(names, worlds, strict=True))).write(tmp_path / "x.fbx")
    for typed, frames in (("walk", 3), ("Walk", 3), ("armature|walk", 3), ("Armature|Run", 4), ("prop|run", 5)):
        assert len(read_fbx_animation(path, name=typed)) == frames
    with pytest.raises(InputError, match="no animation 'run'; it has"):
        read_fbx_animation(path, name="run")


@pytest.mark.parametrize(("named", "drawn"), [("skin.png", True), ("D:\\art\\skin.png", True), ("../no.png", False)])
def test_textures_beside_the_file(hand: Glb, tmp_path: Path, named: str, drawn: bool) -> None:
    """As the file names it, or the same name beside it where the path is another machine's; never from elsewhere."""
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "skin.png").write_bytes(b"picture")
    (tmp_path / "no.png").write_bytes(b"another")
    fbx = as_fbx(hand)
    uv = np.random.default_rng(1).uniform(size=(hand.faces.size, 2)).astype(np.float32)
    skin = replace(fbx.meshes[0], uv=uv, texture=named)
    rig = read_fbx_rig(replace(fbx, meshes=[skin]).write(folder / "a.fbx"))
    assert [part.texture for part in rig.parts] == [b"picture" if drawn else None]
    assert any("not drawn" in note for note in rig.notes) is not drawn
