"""One picture for a mesh that several textures and plain colours cover (an atlas), with coordinates of its corners."""

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
"""Pixels of a texture's longer side in the atlas: larger ones are made smaller."""
_PLAIN = 8
"""Pixels of a tile of one colour."""


@dataclass(frozen=True, eq=False)
class MeshTexture:
    """A picture on a mesh of T triangles.

    Attributes:
        image: uint8 (height, width, 3).
        corner_uv: Coordinates of the triangles' corners, origin at the lower left, shape (T, 3, 2).
    """

    image: NDArray[np.uint8]
    corner_uv: NDArray[np.float32]


def texture_atlas(
    covers: Sequence[tuple[SurfacePaint | None, int, tuple[int, int, int]]], names: str = "it"
) -> MeshTexture | None:
    """The textures of meshes that are drawn as one; None where none has any.

    Coordinates outside of 0…1 repeat the picture, whole triangles at a time.

    Args:
        covers: Of every mesh its paint, its number of triangles, and its colour where it has no paint.
        names: What they are called, for messages.

    Raises:
        InputError: A picture that cannot be read.
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
    """Tiles side by side, and coordinates (T, 3, 2) within them as coordinates within all."""
    sizes = np.array([one.shape[:2] for one in tiles])
    starts = np.concatenate([[0], np.cumsum(sizes[:, 1])])
    height, width = int(sizes[:, 0].max()), int(starts[-1])
    image = np.zeros((height, width, 3), np.uint8)
    for one, start in zip(tiles, starts, strict=False):
        image[height - one.shape[0] :, start : start + one.shape[1]] = one
    # half a pixel from a tile's border, so that its neighbour does not shine in
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
