"""Texture atlas: one texture for a mesh with several textures and plain colours, and its texture coordinates."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.paint import SurfacePaint

__all__ = ["MeshTexture", "texture_atlas"]

_LARGEST = 2048
"""Maximum width and height of a texture in the atlas [pixels]; larger ones are scaled down."""
_PLAIN = 8
"""Width and height of a tile of a plain colour [pixels]."""


@dataclass(frozen=True, eq=False)
class MeshTexture:
    """Texture of a mesh of T triangles.

    Attributes:
        image: RGB image, uint8 (height, width, 3).
        corner_uv: Texture coordinates of the triangles' corners, origin at the lower left, shape (T, 3, 2).
    """

    image: NDArray[np.uint8]
    corner_uv: NDArray[np.float32]


def texture_atlas(
    covers: Sequence[tuple[SurfacePaint | None, int, tuple[int, int, int]]], names: str = "it"
) -> MeshTexture | None:
    """Pack the textures of meshes that are drawn as one into an atlas; None if no mesh has a texture.

    Coordinates outside 0…1 are wrapped per triangle, by the integer part of the triangle's mean, and then clamped.

    Args:
        covers: For each mesh its textures (None: none), its count of triangles, and the colour of untextured triangles.
        names: Name of the meshes, for messages.

    Raises:
        InputError: A texture cannot be read.
    """
    if all(paint is None for paint, _, _ in covers):
        return None
    tiles: list[NDArray[np.uint8]] = []
    uvs, tile_of = [], []
    for paint, count, color in covers:
        plain = len(tiles)
        tiles.append(np.full((_PLAIN, _PLAIN, 3), color, np.uint8))
        uv = np.full((count, 3, 2), 0.5)
        tile = np.full(count, plain)
        if paint is not None:
            painted = paint.image >= 0
            first = len(tiles)
            tiles += [_decoded(data, names) for data in paint.images]
            tile[painted] = first + paint.image[painted]
            own = paint.corner_uv[painted].astype(np.float64)
            uv[painted] = np.clip(own - np.floor(own.mean(axis=1, keepdims=True)), 0.0, 1.0)
        uvs.append(uv)
        tile_of.append(tile)
    return _packed(tiles, np.concatenate(uvs), np.concatenate(tile_of))


def _packed(tiles: Sequence[NDArray[np.uint8]], uv: NDArray[np.float64], tile: NDArray[np.int64]) -> MeshTexture:
    """Atlas of tiles side by side; ``uv`` (T, 3, 2) are coordinates within the tiles with indices ``tile`` (T,)."""
    sizes = np.array([picture.shape[:2] for picture in tiles])
    starts = np.concatenate([[0], np.cumsum(sizes[:, 1])])
    height, width = int(sizes[:, 0].max()), int(starts[-1])
    image = np.zeros((height, width, 3), np.uint8)
    for picture, start in zip(tiles, starts, strict=False):
        image[height - picture.shape[0] :, start : start + picture.shape[1]] = picture
    # stay half a pixel inside a tile: interpolation must not blend in its neighbour
    share = 0.5 + (uv - 0.5) * (1.0 - 1.0 / sizes[tile][:, None, ::-1])
    across = (starts[tile][:, None] + share[..., 0] * sizes[tile, 1][:, None]) / width
    up = share[..., 1] * sizes[tile, 0][:, None] / height
    return MeshTexture(image, np.stack([across, up], axis=-1).astype(np.float32))


def _decoded(data: bytes, names: str) -> NDArray[np.uint8]:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(data)) as picture:
            picture.thumbnail((_LARGEST, _LARGEST))
            return np.asarray(picture.convert("RGB"), np.uint8)
    except (OSError, UnidentifiedImageError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(
            f"{names}: a texture that cannot be read ({error}); COLOR gives a colour in its place"
        ) from error
