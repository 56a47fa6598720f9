"""Base colour textures of USD rigs: read from the folder or the package, and never from elsewhere (R135)."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.io.usd.stages import Stage
from warpjld.geometry.paint import paint_by_parts
from warpjld.io.usd.skin import read_usd_rig

pytest.importorskip("pxr")


def bar() -> Stage:
    """Two joints along x and four vertices between them."""
    frames = np.tile(np.eye(4), (2, 1, 1))
    frames[1, 0, 3] = 0.1
    vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.05, 0], [0, 0, 0.05]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    uv = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    return Stage(["a", "b"], [-1, 0], frames, vertices, faces, np.zeros((4, 1), int), np.ones((4, 1)), uv=uv)


def painted(folder: Path, image: str, suffix: str = ".usda") -> Path:
    """The bar with a preview surface whose colour comes from an image."""
    from pxr import Sdf, Usd, UsdGeom, UsdShade

    path = bar().write(folder / f"bar{suffix}")
    stage = Usd.Stage.Open(str(path))
    material = UsdShade.Material.Define(stage, "/World/Skin")
    surface = UsdShade.Shader.Define(stage, "/World/Skin/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    texture = UsdShade.Shader.Define(stage, "/World/Skin/Picture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(image))
    colour = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(colour)
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    mesh = next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    UsdShade.MaterialBindingAPI.Apply(mesh).Bind(material)
    stage.GetRootLayer().Save()
    return path


def encoded() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (4, 4), (220, 20, 20)).save(out, "PNG")
    return out.getvalue()


@pytest.mark.parametrize("package", [False, True])
def test_textures_of_stages_and_packages(tmp_path: Path, package: bool) -> None:
    from pxr import UsdUtils

    (tmp_path / "red.png").write_bytes(encoded())
    path = painted(tmp_path, "./red.png", ".usdc" if package else ".usda")
    if package:
        assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "bar.usdz"))
        (tmp_path / "red.png").unlink()
        path = tmp_path / "bar.usdz"
    rig = read_usd_rig(path)
    assert rig.notes == ()
    uv = rig.corner_uv if rig.corner_uv is not None else rig.uv[rig.faces]
    paint = paint_by_parts(uv, rig.parts, len(rig.faces))
    assert paint is not None
    assert paint.images == (encoded(),)
    assert paint.image.tolist() == [0] * len(rig.faces)


@pytest.mark.parametrize("image", ["missing.png", "../outside/red.png", "/etc/hostname"])
def test_textures_that_are_not_there_or_elsewhere(tmp_path: Path, image: str) -> None:
    folder = tmp_path / "inside"
    (tmp_path / "outside").mkdir()
    folder.mkdir()
    (tmp_path / "outside" / "red.png").write_bytes(encoded())
    rig = read_usd_rig(painted(folder, image))
    assert all(part.texture is None for part in rig.parts)
    assert any("is not drawn" in note for note in rig.notes)
