"""Base colour textures of a surface, per triangle (R135)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.surface import Part, Surface

__all__ = ["SurfacePaint", "paint_by_parts", "paint_of_surface"]


@dataclass(frozen=True, eq=False)
class SurfacePaint:
    """Textures of T triangles.

    Attributes:
        corner_uv: Texture coordinates of the corners, origin at the lower left of the image, shape (T, 3, 2).
        image: Index into ``images`` for each triangle, -1 for none, shape (T,).
        images: Encoded image files: PNG, JPEG, …
    """

    corner_uv: NDArray[np.float32]
    image: NDArray[np.int32]
    images: tuple[bytes, ...]


def paint_by_parts(corner_uv: NDArray[np.float32] | None, parts: tuple[Part, ...], count: int) -> SurfacePaint | None:
    """Textures of the triangles of a file, taken from its parts; None if no part has a texture.

    Args:
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2); None if the file has none.
        parts: Parts of the file, with their triangles and textures.
        count: Count S of triangles in the file.
    """
    images: list[bytes] = []
    image = np.full(count, -1, np.int32)
    for part in parts:
        whole = () if part.texture is None else ((part.faces, part.texture),)
        for faces, texture in (*whole, *part.painted):
            if texture not in images:
                images.append(texture)
            image[faces] = images.index(texture)
    if corner_uv is None or not images:
        return None
    return SurfacePaint(np.asarray(corner_uv, np.float32), image, tuple(images))


def paint_of_surface(surface: Surface) -> SurfacePaint | None:
    """Textures of a surface's triangles, in the order of ``surface.faces``; None if its file has no textures."""
    corner_uv = surface.corner_uv
    if corner_uv is None and surface.uv is not None:
        corner_uv = surface.uv[surface.source_faces]
    found = paint_by_parts(corner_uv, surface.parts, len(surface.source_faces))
    if found is None:
        return None
    rows = surface.source_rows
    return SurfacePaint(found.corner_uv[rows], found.image[rows], found.images)
