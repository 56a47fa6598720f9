"""Base colour textures of files are read, kept through welding and mending, and drawn in their places (R135, R141)."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from warpjld.errors import InputError
from warpjld.geometry.paint import SurfacePaint, paint_by_parts, paint_of_surface
from warpjld.geometry.surface import Part, weld_surface
from warpjld.grasp import load_object
from warpjld.io.mesh_file import read_mesh
from warpjld.render import Camera, Quality, SceneRenderer, Solid
from warpjld.render.texture import texture_atlas
from warpjld.script import Interpreter, Scene
from warpjld.script.pictures import style_of
from warpjld.script.props import texture_of

RED, BLUE = (220, 20, 20), (20, 20, 220)


def picture() -> Image.Image:
    """Red on the left, blue on the right."""
    pixels = np.zeros((8, 16, 3), np.uint8)
    pixels[:, :8], pixels[:, 8:] = RED, BLUE
    return Image.fromarray(pixels)


def encoded(image: Image.Image) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


def cube() -> trimesh.Trimesh:
    """A cube of 0.1 m, a vertex for each corner of each face: u goes along x, v along y."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    vertices, faces = box.vertices[box.faces.ravel()], np.arange(36).reshape(-1, 3)
    visual = trimesh.visual.TextureVisuals(uv=vertices[:, :2] / 0.1 + 0.5, image=picture())
    return trimesh.Trimesh(vertices, faces, visual=visual, process=False)


def seen(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Mean colours of the left and the right half of a solid, from +z."""
    with SceneRenderer(
        np.zeros((0, 3), int),
        Camera((0.0, 0.0, 0.4), (0.0, 0.0, 0.0)),
        size=(64, 64),
        solids=[solid],
        quality=Quality.draft(),
    ) as stage:
        drawn = stage.draw(np.zeros((0, 3))).astype(float)
    middle = drawn[24:40]
    return middle[:, 24:30].mean(axis=(0, 1)), middle[:, 34:40].mean(axis=(0, 1))


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_textures_of_files_are_drawn_where_they_belong(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"cube{suffix}"
    cube().export(path)
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(f'OBJECT cube "{path}"')
    prop = scene.props["CUBE"]
    assert len(prop.thing.vertices) == 8  # welded
    assert prop.thing.paint is not None
    for row, corners in zip(prop.thing.paint.corner_uv, prop.thing.vertices[prop.thing.faces], strict=True):
        np.testing.assert_allclose(row, corners[:, :2] / 0.1 + 0.5, atol=1e-5)
    left, right = seen(Solid(prop.thing.vertices, prop.thing.faces, texture=texture_of(prop)))
    assert left[0] > 2.0 * left[2]
    assert right[2] > 2.0 * right[0]
    Interpreter(scene).run_text('COLOR cube "green"')
    assert texture_of(prop) is None


def test_turned_triangles_keep_their_coordinates(tmp_path: Path) -> None:
    """Mending turns a triangle that looks inwards: its corners change places, their coordinates with them."""
    mesh = cube()
    faces = mesh.faces.copy()
    faces[5] = faces[5][::-1]
    visual = trimesh.visual.TextureVisuals(uv=mesh.visual.uv, image=picture())
    path = tmp_path / "cube.glb"
    trimesh.Trimesh(mesh.vertices, faces, visual=visual, process=False).export(path)
    thing = load_object(path)
    assert thing.paint is not None
    np.testing.assert_allclose(thing.paint.corner_uv, thing.vertices[thing.faces][..., :2] / 0.1 + 0.5, atol=1e-5)


def test_an_actors_surface_has_the_paint_of_its_parts() -> None:
    """Two parts, one with a picture; welding leaves out a triangle without area, and the paint with it."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]])
    faces = np.array([[0, 1, 2], [0, 1, 1], [3, 4, 5]])
    parts = (Part("plain", slice(0, 3), slice(0, 2)), Part("painted", slice(3, 6), slice(2, 3), encoded(picture())))
    surface = weld_surface(points, faces, uv=points[:, :2].astype(np.float32), parts=parts)
    paint = paint_of_surface(surface)
    assert paint is not None
    assert paint.image.tolist() == [-1, 0]
    np.testing.assert_allclose(paint.corner_uv[1], points[3:, :2])


def test_an_atlas_holds_what_its_tiles_hold() -> None:
    paint = SurfacePaint(
        np.array([[[0.1, 0.5], [0.2, 0.5], [1.3, 0.5]]] * 2, np.float32),
        np.array([0, -1], np.int32),
        (encoded(picture()),),
    )
    found = texture_atlas([(None, 1, (1, 2, 3)), (paint, 2, (4, 5, 6))])
    assert found is not None
    height, width = found.image.shape[:2]
    column = np.clip((found.corner_uv[..., 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1.0 - found.corner_uv[..., 1]) * height).astype(int), 0, height - 1)
    colors = found.image[row, column]
    assert (colors[0] == [1, 2, 3]).all()
    assert (colors[2] == [4, 5, 6]).all()
    assert colors[1].tolist() == [list(RED), list(RED), list(BLUE)]
    assert texture_atlas([(None, 1, (1, 2, 3))]) is None


def test_several_materials_of_an_obj_file(tmp_path: Path) -> None:
    """Two squares, red and blue by their own pictures, and one without."""
    lines = ["mtllib two.mtl"]
    for k, material in enumerate(("warm coat", "cold", "bare")):
        lines += [f"v {k + x} {y} 0" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", f"usemtl {material}"]
        lines.append("f " + " ".join(f"{4 * k + i}/{4 * k + i}" for i in (1, 2, 3, 4)))
    (tmp_path / "two.obj").write_text("\n".join(lines))
    (tmp_path / "two.mtl").write_text("newmtl warm coat\nmap_Kd red.png\nnewmtl cold\nmap_Kd blue.png\nnewmtl bare\n")
    for name, color in (("red", RED), ("blue", BLUE)):
        Image.new("RGB", (4, 4), color).save(tmp_path / f"{name}.png")
    mesh = read_mesh(tmp_path / "two.obj")
    assert mesh.notes == ()
    paint = paint_by_parts(mesh.corner_uv if mesh.uv is None else mesh.uv[mesh.faces], mesh.parts, len(mesh.faces))
    assert paint is not None
    assert paint.image.tolist() == [0, 0, 1, 1, -1, -1]
    found = texture_atlas([(paint, 6, (1, 2, 3))])
    assert found is not None
    height, width = found.image.shape[:2]
    middle = found.corner_uv.mean(axis=1)
    colors = found.image[((1.0 - middle[:, 1]) * height).astype(int), (middle[:, 0] * width).astype(int)]
    assert colors.tolist() == [list(RED)] * 2 + [list(BLUE)] * 2 + [[1, 2, 3]] * 2
    (tmp_path / "blue.png").unlink()  # the other is drawn all the same
    mesh = read_mesh(tmp_path / "two.obj")
    assert "its texture is not drawn" in mesh.notes[0]
    assert len(mesh.parts[0].painted) == 1


def test_what_is_not_there_or_no_picture(tmp_path: Path) -> None:
    path = tmp_path / "cube.obj"
    cube().export(path)
    next(tmp_path.glob("*.png")).write_bytes(b"no picture")
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(f'OBJECT cube "{path}"')
    with pytest.raises(InputError, match=r"CUBE: a texture that cannot be read.*COLOR gives"):
        texture_of(scene.props["CUBE"])
    next(tmp_path.glob("*.png")).unlink()
    assert load_object(path).paint is None


def test_a_picture_behind_everything(tmp_path: Path) -> None:
    path = tmp_path / "sky.png"
    picture().save(path)
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(f'BACKDROP PICTURE "{path}"')
    thing = trimesh.creation.icosphere(radius=0.03)
    solid = Solid(np.asarray(thing.vertices), np.asarray(thing.faces), color="#ffffff")
    with SceneRenderer(
        np.zeros((0, 3), int),
        Camera((0.0, 0.0, 0.4), (0.0, 0.0, 0.0)),
        size=(64, 64),
        solids=[solid],
        style=style_of(scene),
    ) as stage:
        drawn = stage.draw(np.zeros((0, 3)))
    assert np.abs(drawn[4, 4].astype(int) - RED).max() < 3
    assert np.abs(drawn[60, 60].astype(int) - BLUE).max() < 3
    assert drawn[32, 32].min() > 90  # the ball is before it
    path.write_bytes(b"none")
    with pytest.raises(InputError, match="no picture that can be read"):
        Interpreter(scene).run_text(f'BACKDROP PICTURE "{path}"')
