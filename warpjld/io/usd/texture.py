"""Base colour texture of a UsdGeom mesh: the image that its UsdPreviewSurface takes its diffuse colour from."""

from __future__ import annotations

import zipfile
from pathlib import PurePosixPath
from typing import Any

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.io.gltf.schema import inside_folder
from warpjld.io.usd.stage import UsdFile

__all__ = ["usd_texture"]


def usd_texture(file: UsdFile, prim: Any) -> bytes | None:
    """Encoded image of a mesh's base colour texture, from the stage's folder or package; None without one.

    A texture that cannot be read is noted. Materials of subsets of a mesh are not followed.
    """
    from pxr import UsdShade

    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource()[0] if material else None
    colour = shader.GetInput("diffuseColor") if shader else None
    sources = colour.GetConnectedSources()[0] if colour else []
    if not sources:
        return None
    image = UsdShade.Shader(sources[0].source.GetPrim()).GetInput("file")
    values = image.GetValueProducingAttributes() if image else []
    asset = values[0].Get() if values else None
    name = getattr(asset, "path", "")
    if not name:
        return None
    try:
        return _content(file, inside_folder(name))
    except (InputError, OSError, KeyError, zipfile.BadZipFile) as error:
        file.notes.append(f"mesh '{prim.GetPath()}': its texture '{name}' is not drawn: {error}")
        return None


def _content(file: UsdFile, name: str) -> bytes:
    if not zipfile.is_zipfile(file.path):
        return read_bytes(file.path.parent / name)
    with zipfile.ZipFile(file.path) as package:  # its sizes were checked when the stage was opened
        return package.read(str(PurePosixPath(name)))
