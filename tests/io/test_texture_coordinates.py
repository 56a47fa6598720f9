"""Texture coordinates through every format, read back by other libraries, and a picture of a textured hand.

glTF counts v from the picture's upper edge, OBJ, USD and Alembic from the lower one; so do trimesh, which turns glTF's
over, and VTK.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh

from warpjld.covering import bind
from warpjld.geometry.surface import Surface, weld_surface
from warpjld.io import load_rig
from warpjld.io.caches import open_cache
from warpjld.io.mesh_file import read_mesh
from warpjld.io.usd.skin import read_usd_rig
from warpjld.motion.load import load_motion

CLOSE = 2e-7  # 1 - (1 - v) in float32


def accessor(path: Path, name: str) -> np.ndarray:
    """A float attribute of a GLB's only primitive, read from the bytes."""
    file = pygltflib.GLTF2().load(str(path))
    (primitive,) = file.meshes[0].primitives
    wanted = file.accessors[getattr(primitive.attributes, name)]
    view = file.bufferViews[wanted.bufferView]
    assert wanted.componentType == pygltflib.FLOAT
    assert not view.byteStride
    start = (view.byteOffset or 0) + (wanted.byteOffset or 0)
    width = {"VEC2": 2, "VEC3": 3}[wanted.type]
    return np.frombuffer(file.binary_blob(), "<f4", width * wanted.count, start).reshape(-1, width)


def triangles(path: Path) -> np.ndarray:
    file = pygltflib.GLTF2().load(str(path))
    wanted = file.accessors[file.meshes[0].primitives[0].indices]
    view = file.bufferViews[wanted.bufferView]
    kind = {pygltflib.UNSIGNED_SHORT: "<u2", pygltflib.UNSIGNED_INT: "<u4"}[wanted.componentType]
    start = (view.byteOffset or 0) + (wanted.byteOffset or 0)
    return np.frombuffer(file.binary_blob(), kind, wanted.count, start).reshape(-1, 3).astype(np.int64)


@pytest.fixture(scope="module")
def exported(data: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The WebXR hand with one bent finger in every format, and the file it came from."""
    folder = tmp_path_factory.mktemp("textured")
    source = data / "hand_webxr_generic" / "left.glb"
    rig = load_rig(source)
    (folder / "one.csv").write_text("frame,index.base.flexion\n0,45\n")
    moved = load_motion(folder / "one.csv", rig)
    poses, rate = moved.poses, moved.rate
    moved = bind(rig.skeleton, rig.surface).deform(poses)
    for suffix in ("usda", "usdc", "obj", "glb", "abc", "npz"):
        with open_cache(folder / f"hand.{suffix}", rig.surface, frames=len(moved), rate=rate) as cache:
            cache.write(moved)
    return {path.suffix[1:]: path for path in folder.iterdir() if path.suffix != ".csv"} | {"source": source}


def test_every_format_has_the_sources_coordinates(exported: dict[str, Path]) -> None:
    want = accessor(exported["source"], "TEXCOORD_0")  # from the upper left
    corners = want[triangles(exported["source"])]
    upright = corners * [1, -1] + [0, 1]
    np.testing.assert_allclose(accessor(exported["glb"], "TEXCOORD_0"), want, atol=CLOSE)
    for kind in ("obj", "glb"):
        mesh = trimesh.load(exported[kind], process=False, force="mesh")
        np.testing.assert_allclose(mesh.visual.uv[mesh.faces], upright, atol=CLOSE)
        again = read_mesh(exported[kind])
        assert again.uv is not None
        np.testing.assert_allclose(again.uv[again.faces], upright, atol=CLOSE)
    with np.load(exported["npz"]) as arrays:
        np.testing.assert_allclose(arrays["uv"][arrays["faces"]], upright, atol=CLOSE)


@pytest.mark.parametrize("kind", ["usda", "usdc"])
def test_usd_has_the_sources_coordinates(exported: dict[str, Path], kind: str) -> None:
    pytest.importorskip("pxr", reason="the extra 'usd' is not installed")
    from pxr import Usd, UsdGeom

    want = accessor(exported["source"], "TEXCOORD_0") * [1, -1] + [0, 1]
    stage = Usd.Stage.Open(str(exported[kind]))
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert st.GetInterpolation() == UsdGeom.Tokens.vertex
    np.testing.assert_allclose(np.array(st.Get()), want, atol=CLOSE)
    np.testing.assert_array_equal(
        np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3), triangles(exported["source"])
    )


def picture(seen: np.ndarray, faces: np.ndarray, corner_uv: np.ndarray, texture: np.ndarray, spot: np.ndarray):
    """A textured surface drawn by VTK, seen from the side of ``spot``, and the pixel at which ``spot`` lies.

    VTK counts texture coordinates from the lower left; ``texture`` has its upper row first, as picture files do.
    """
    import pyvista
    import vtk

    corners = seen[faces].reshape(-1, 3)
    mesh = pyvista.PolyData(corners, np.insert(np.arange(len(corners)).reshape(-1, 3), 0, 3, axis=1))
    mesh.active_texture_coordinates = corner_uv.reshape(-1, 2)
    plotter = pyvista.Plotter(off_screen=True, window_size=(500, 500), lighting="none")
    plotter.background_color = "white"
    plotter.add_mesh(mesh, texture=pyvista.Texture(texture), lighting=False)
    middle, (point, normal) = corners.mean(axis=0), spot
    plotter.camera_position = [middle + 0.4 * normal, middle, np.cross(normal, [0.3, 0.5, 0.8])]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.12
    shown = plotter.screenshot(return_img=True)
    where = vtk.vtkCoordinate()
    where.SetCoordinateSystemToWorld()
    where.SetValue(*point)
    x, y = where.GetComputedDisplayValue(plotter.renderer)
    plotter.close()
    return shown, (shown.shape[0] - 1 - y, x)


def read_back(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions at the first frame, triangles, and upright texture coordinates of their corners, by other libraries."""
    if path.suffix == ".usda":
        from pxr import Usd, UsdGeom

        stage = Usd.Stage.Open(str(path))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        points = np.array(mesh.GetPointsAttr().Get(Usd.TimeCode.EarliestTime()))
        return points, faces, np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened())[faces]
    found = trimesh.load(path, process=False, force="mesh")
    return np.array(found.vertices), np.array(found.faces), found.visual.uv[found.faces]


@pytest.mark.parametrize("kind", ["usda", "obj", "glb"])
def test_a_textures_mark_shows_where_gltf_has_it(exported: dict[str, Path], kind: str, tmp_path: Path) -> None:
    """A red mark painted where glTF's own rule puts one vertex of the source is seen at that vertex, in no other place.

    Turned upside down the same file shows none there: what is tested can fail.
    """
    if kind == "usda":
        pytest.importorskip("pxr", reason="the extra 'usd' is not installed")
    pytest.importorskip("pyvista")
    from PIL import Image

    source = exported["source"]
    uv, positions = accessor(source, "TEXCOORD_0"), accessor(source, "POSITION")
    normals = accessor(source, "NORMAL")
    middle = positions.mean(axis=0)
    marked = int(np.argmin(np.linalg.norm(positions - middle - 0.02 * np.sign(normals), axis=1)))
    size = 512
    rows, columns = np.indices((size, size)) * 16 // size
    texture = np.where((rows + columns)[..., None] % 2, [90, 120, 200], [235, 235, 220]).astype(np.uint8)
    column, row = np.round(uv[marked] * size - 0.5).astype(int)  # glTF: from the upper left
    texture[max(row - 8, 0) : row + 9, max(column - 8, 0) : column + 9] = [220, 20, 20]

    seen, faces, corner_uv = read_back(exported[kind])
    spot = seen[marked], np.asarray(trimesh.Trimesh(seen, faces, process=False).vertex_normals)[marked]
    shown, (y, x) = picture(seen, faces, corner_uv, texture, spot)
    Image.fromarray(shown).save(tmp_path / f"{kind}.png")
    red = (shown[..., 0] > 150) & (shown[..., 1:].max(axis=-1) < 90)
    assert red[y, x]
    assert np.abs(np.argwhere(red) - (y, x)).max() < 40
    assert 20 < red.sum() < 2500

    wrong, _ = picture(seen, faces, corner_uv * [1, -1] + [0, 1], texture, spot)
    assert not ((wrong[y, x, 0] > 150) and wrong[y, x, 1] < 90)


@pytest.fixture
def cube() -> Surface:
    """A cube of eight vertices, each with three pairs of texture coordinates, and two vertices that no face uses."""
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    points = np.insert(np.array(box.vertices), [0, 4], [[0.5, 0.5, 0.5], [0.1, 0.0, 0.0]], axis=0)
    place = np.delete(np.arange(10), [0, 5])
    corner_uv = np.random.default_rng(4).random((12, 3, 2)).astype(np.float32)
    return weld_surface(points, place[np.array(box.faces)], corner_uv=corner_uv)


def write(surface: Surface, path: Path) -> Path:
    with open_cache(path, surface, frames=1, rate=25) as cache:
        cache.write(surface.vertices[None].astype(np.float32))
    return cache.files[0]


def test_seams_within_vertices_are_kept_by_corner(cube: Surface, tmp_path: Path) -> None:
    points = cube.to_source(cube.vertices)[cube.source_faces].astype(np.float32)
    path = write(cube, tmp_path / "a.obj")
    for read in (read_mesh, lambda path: trimesh.load(path, process=False, force="mesh")):
        mesh = read(path)
        np.testing.assert_allclose(mesh.vertices[mesh.faces], points, atol=1e-8)
    np.testing.assert_allclose(mesh.visual.uv[mesh.faces], cube.corner_uv, atol=CLOSE)
    again = read_mesh(path)
    np.testing.assert_array_equal(again.corner_uv, cube.corner_uv)
    assert len(again.vertices) == 10
    np.testing.assert_array_equal(again.faces, cube.source_faces)
    with np.load(write(cube, tmp_path / "a.npz")) as arrays:
        np.testing.assert_array_equal(arrays["corner_uv"], cube.corner_uv)
        assert "uv" not in arrays.files
    for suffix in ("pc2", "mdd"):
        write(cube, tmp_path / f"a.{suffix}")
        rest = read_mesh(tmp_path / "a.rest.obj")
        assert len(rest.vertices) == 10
        np.testing.assert_array_equal(rest.corner_uv, cube.corner_uv)


def test_gltf_gets_copies_of_vertices_on_seams_behind_the_sources(cube: Surface, tmp_path: Path) -> None:
    with open_cache(tmp_path / "a.glb", cube, frames=1, rate=25) as cache:
        cache.write(1.5 * cube.vertices[None].astype(np.float32))
    assert "after the source's 10 vertices 28 copies" in cache.note  # 36 corners that all differ, less eight vertices
    points = accessor(tmp_path / "a.glb", "POSITION")
    np.testing.assert_allclose(points[:10], cube.to_source(cube.vertices), atol=1e-8)
    faces = triangles(tmp_path / "a.glb")
    np.testing.assert_allclose(points[faces], cube.to_source(cube.vertices)[cube.source_faces], atol=1e-8)
    uv = accessor(tmp_path / "a.glb", "TEXCOORD_0")
    np.testing.assert_allclose(uv[faces] * [1, -1] + [0, 1], cube.corner_uv, atol=CLOSE)
    normals = accessor(tmp_path / "a.glb", "NORMAL")[faces]
    inward = np.einsum("fck,fck->fc", normals, points[faces]) < 0
    assert not inward.any()
    file = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    (target,) = file.meshes[0].primitives[0].targets
    assert file.accessors[target["POSITION"]].count == len(points) == 38


def test_usd_has_seams_as_face_varying(cube: Surface, tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="the extra 'usd' is not installed")
    from pxr import Usd, UsdGeom

    for suffix in ("usda", "usdc"):
        stage = Usd.Stage.Open(str(write(cube, tmp_path / f"a.{suffix}")))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        assert st.GetInterpolation() == UsdGeom.Tokens.faceVarying
        np.testing.assert_allclose(np.array(st.Get()).reshape(-1, 3, 2), cube.corner_uv, atol=CLOSE)
        assert len(mesh.GetPointsAttr().Get()) == 10


def test_alembic_has_seams_by_corner(cube: Surface, tmp_path: Path) -> None:
    pytest.importorskip("alembic3d", reason="the extra 'abc' is not installed")
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(write(cube, tmp_path / "a.abc")))
    transform = archive.getTop().getChild(0)
    schema = AbcGeom.IPolyMesh(transform, transform.getChild(0).getName()).getSchema()
    uv = schema.getUVsParam().getExpandedValue().getVals()
    found = np.reshape([tuple(pair) for pair in uv], (-1, 3, 2))[:, ::-1]  # clockwise
    np.testing.assert_array_equal(found, cube.corner_uv)
    assert len(schema.getValue().getPositions()) == 10


def test_a_textured_tubes_seam_survives_a_skinned_export(tmp_path: Path) -> None:
    """A rig from OBJ and skeleton file → a USD with a skeleton, read again: vertices and seams as they were."""
    pytest.importorskip("pxr", reason="the extra 'usd' is not installed")
    from warpjld.motion.out.write import write_motion
    from warpjld.skeleton import rest_poses

    rig = load_rig(seamed_tube(tmp_path), skeleton=tmp_path / "tube.json", unit="m")
    assert rig.surface.corner_uv is not None
    write_motion(tmp_path / "tube.usda", rig, rest_poses(rig.skeleton), rate=25.0)
    again = read_usd_rig(tmp_path / "tube.usda")
    assert len(again.vertices) == len(rig.surface.weld) == 60
    np.testing.assert_allclose(again.corner_uv, rig.surface.corner_uv, atol=CLOSE)
    write_motion(tmp_path / "tube.glb", rig, rest_poses(rig.skeleton), rate=25.0)
    faces = triangles(tmp_path / "tube.glb")
    uv = accessor(tmp_path / "tube.glb", "TEXCOORD_0")[faces]
    np.testing.assert_allclose(uv * [1, -1] + [0, 1], rig.surface.corner_uv, atol=CLOSE)
    np.testing.assert_allclose(
        accessor(tmp_path / "tube.glb", "POSITION")[faces],
        rig.surface.vertices[rig.surface.weld[rig.surface.source_faces]],
        atol=1e-7,
    )


def seamed_tube(folder: Path) -> Path:
    """A tube of ten rings of six vertices whose texture is wound round it once, and a skeleton of three joints."""
    around, rings = 6, 10
    lines = [
        f"v {0.02 * np.cos(np.pi * a / 3):.6f} {0.02 * np.sin(np.pi * a / 3):.6f} {-0.03 * r:.6f}"
        for r in range(rings)
        for a in range(around)
    ]
    lines += [f"vt {a / around:.6f} {r / (rings - 1):.6f}" for r in range(rings) for a in range(around + 1)]
    for r in range(rings - 1):
        for a in range(around):
            four = [(r, a), (r + 1, a), (r + 1, a + 1), (r, a + 1)]
            face = [f"{1 + y * around + x % around}/{1 + y * (around + 1) + x}" for y, x in four]
            lines.append("f " + " ".join(face))
    (folder / "tube.obj").write_text("\n".join(lines) + "\n")
    (folder / "tube.json").write_text(
        '{"joints": [{"name": "a", "parent": null, "position": [0, 0, 0]},'
        '{"name": "b", "parent": "a", "position": [0, 0, -0.09]},'
        '{"name": "c", "parent": "b", "position": [0, 0, -0.18]}]}'
    )
    return folder / "tube.obj"
