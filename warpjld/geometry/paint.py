"""Pictures on a surface: base colour textures of its file, by triangle (R135)."""

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
        corner_uv: Texture coordinates of their corners, origin at a picture's lower left, shape (T, 3, 2).
        image: Picture of each, -1 where it has none, shape (T,).
        images: Pictures as their files hold them: PNG, JPEG, …
    """

    corner_uv: NDArray[np.float32]
    image: NDArray[np.int32]
    images: tuple[bytes, ...]


def paint_by_parts(corner_uv: NDArray[np.float32] | None, parts: tuple[Part, ...], count: int) -> SurfacePaint | None:
    """Paint of a file's triangles, shape (S, 3, 2), by the pictures of its parts; None where no part has one."""
    images: list[bytes] = []
    image = np.full(count, -1, np.int32)
    for part in parts:
        if part.texture is not None:
            if part.texture not in images:
                images.append(part.texture)
            image[part.faces] = images.index(part.texture)
    if corner_uv is None or not images:
        return None
    return SurfacePaint(np.asarray(corner_uv, np.float32), image, tuple(images))


def paint_of_surface(surface: Surface) -> SurfacePaint | None:
    """Paint of a surface's own triangles, in their order; None where its file has no pictures."""
    corner_uv = surface.corner_uv
    if corner_uv is None and surface.uv is not None:
        corner_uv = surface.uv[surface.source_faces]
    found = paint_by_parts(corner_uv, surface.parts, len(surface.source_faces))
    if found is None:
        return None
    rows = surface.source_rows
    return SurfacePaint(found.corner_uv[rows], found.image[rows], found.images)
