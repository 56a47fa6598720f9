"""Texture coordinates of a glTF primitive, with v upwards from the image's lower left corner."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.io.gltf.document import Document
from warpjld.io.gltf.schema import inside_folder

__all__ = ["base_color_picture", "texture_coordinates"]


def texture_coordinates(document: Document, primitive: Any, count: int, name: str) -> NDArray[np.float32] | None:
    """Coordinates used by the base colour texture of the primitive's material, shape (V, 2); None without any.

    ``KHR_texture_transform`` is applied.

    Raises:
        InputError: Their number differs from that of vertices.
    """
    info = _base_colour(document, primitive)
    moved = (info.extensions or {}).get("KHR_texture_transform", {}) if info is not None else {}
    number = moved.get("texCoord", (info.texCoord if info is not None else None) or 0)
    attributes = vars(primitive.attributes)
    accessor = attributes.get(f"TEXCOORD_{number}")
    if accessor is None:
        return None
    uv = document.accessor(accessor).astype(np.float64)
    if uv.shape != (count, 2):
        raise InputError(f"mesh '{name}': want {count} texture coordinates, got {len(uv)}", path=document.path)
    if moved:
        angle = float(moved.get("rotation", 0.0))
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        uv = (uv * moved.get("scale", (1.0, 1.0))) @ turn.T + moved.get("offset", (0.0, 0.0))
    return (uv * [1.0, -1.0] + [0.0, 1.0]).astype(np.float32)


def base_color_picture(document: Document, primitive: Any) -> bytes | None:
    """Encoded image of a primitive's base colour texture; None without one, or if it is missing."""
    info, gltf = _base_colour(document, primitive), document.gltf
    if info is None or info.index is None or not 0 <= info.index < len(gltf.textures):
        return None
    source = gltf.textures[info.index].source
    if source is None or not 0 <= source < len(gltf.images):
        return None
    picture = gltf.images[source]
    try:
        if picture.uri is None:
            return document.view_bytes(picture.bufferView)
        if picture.uri.startswith("data:"):
            return base64.b64decode(picture.uri.partition(",")[2])
        return read_bytes(document.path.parent / inside_folder(picture.uri))
    except (InputError, ValueError):  # missing textures do not prevent reading the surface
        return None


def _base_colour(document: Document, primitive: Any) -> Any:
    if primitive.material is None or not 0 <= primitive.material < len(document.gltf.materials):
        return None
    surface = document.gltf.materials[primitive.material].pbrMetallicRoughness
    return None if surface is None else surface.baseColorTexture
