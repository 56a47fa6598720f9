"""Labels of vertices and facets on a picture by the file's own numbers, to which the animator's tools refer (R133)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.render.text import font

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from warpjld.render.scene import Image, SceneRenderer

__all__ = ["Numbered", "with_numbers"]

_VERTEX, _FACET, _EDGE, _PAPER = "#1d1d1d", "#1b4f9c", (70, 60, 55, 110), (255, 255, 255, 165)
_SMALLEST = 9  # smallest height of text [pixels]
_LINES = 60  # height of a picture in lines of text


@dataclass(frozen=True, eq=False)
class Numbered:
    """A surface whose vertices and facets are labelled.

    Attributes:
        points: Vertices as drawn [m], shape (n, 3).
        faces: Triangles, shape (t, 3).
        numbers: Number of every vertex, shape (n,).
        facets: Facet of every triangle, shape (t,).
    """

    points: NDArray[np.float64]
    faces: NDArray[np.integer]
    numbers: NDArray[np.integer]
    facets: NDArray[np.integer]

    def middles(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Centroid of every facet [m], shape (f, 3), and its number, shape (f,)."""
        numbers, row = np.unique(self.facets, return_inverse=True)
        corners = self.points[self.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) + 1e-30
        total = np.bincount(row, area)
        sums = [np.bincount(row, area * corners.mean(axis=1)[:, k]) / total for k in range(3)]
        return np.stack(sums, axis=1), numbers.astype(np.int64)

    def edges(self) -> NDArray[np.integer]:
        """Edges of the facets, without the diagonals of triangulated polygons, shape (e, 2)."""
        half = np.sort(np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]]), axis=1)
        once, kind = np.unique(half, axis=0, return_inverse=True)
        facet = np.tile(self.facets, 3)
        low, high = np.full(len(once), np.iinfo(np.int64).max), np.full(len(once), -1)
        np.minimum.at(low, kind.ravel(), facet)
        np.maximum.at(high, kind.ravel(), facet)
        count = np.bincount(kind.ravel(), minlength=len(once))
        return np.asarray(once[(low != high) | (count == 1)])


def with_numbers(picture: Image, scene: SceneRenderer, surfaces: list[Numbered]) -> Image:
    """The picture that a scene drew last, with the visible edges and numbers of surfaces.

    Numbers that would overlap others are left out; a line at the bottom says how many are shown.

    Args:
        picture: The picture, uint8 (height, width, 3).
        scene: The renderer that drew it.
        surfaces: Surfaces in it to label.
    """
    from PIL import Image as Pictures
    from PIL import ImageDraw

    canvas = Pictures.fromarray(picture).convert("RGB")
    draw = ImageDraw.Draw(canvas, "RGBA")
    board = _Board(draw, canvas.size, max(_SMALLEST, canvas.size[1] // _LINES))
    vertices: list[tuple[NDArray[np.float64], NDArray[np.integer]]] = []
    facets: list[tuple[NDArray[np.float64], NDArray[np.integer]]] = []
    for surface in surfaces:
        places, seen = scene.seen(surface.points)
        for a, b in surface.edges():
            if seen[a] and seen[b]:
                draw.line([*places[a], *places[b]], fill=_EDGE)
        vertices.append((places[seen], surface.numbers[seen]))
        middles, numbers = surface.middles()
        places, seen = scene.seen(middles)
        facets.append((places[seen], numbers[seen]))
    counts = []
    for name, labels, color in (("vertices", vertices, _VERTEX), ("facets", facets, _FACET)):
        drawn = sum(
            board.write(place, str(number), color) for of_one in labels for place, number in zip(*of_one, strict=True)
        )
        counts.append(f"{name} {drawn:,} of {sum(len(numbers) for _, numbers in labels):,} in view")
    board.legend(f"{counts[0]} (black), {counts[1]} (blue); ZOOM shows more")
    return np.ascontiguousarray(canvas, np.uint8)


class _Board:
    """Text on a picture without overlaps: keeps the pixels that labels cover."""

    def __init__(self, draw: ImageDraw, size: tuple[int, int], height: int) -> None:
        self._draw, self._size, self._font = draw, size, font(height)
        self._height = height
        self._taken = np.zeros((size[1], size[0]), dtype=bool)
        self._taken[size[1] - 2 * height :] = True

    def write(self, place: NDArray[np.float64], text: str, color: str) -> bool:
        """Write a number, centred; False where there is no room."""
        half = 0.5 * self._draw.textlength(text, font=self._font) + 1.0, 0.5 * self._height + 1.0
        x0, y0 = (int(np.floor(place[k] - half[k])) for k in (0, 1))
        x1, y1 = (int(np.ceil(place[k] + half[k])) for k in (0, 1))
        if x0 < 0 or y0 < 0 or x1 >= self._size[0] or y1 >= self._size[1] or self._taken[y0:y1, x0:x1].any():
            return False
        self._taken[y0:y1, x0:x1] = True
        self._draw.rectangle([x0, y0, x1, y1], fill=_PAPER)
        self._draw.text(tuple(place.tolist()), text, fill=color, font=self._font, anchor="mm")
        return True

    def legend(self, text: str) -> None:
        """Write a line at the bottom."""
        at = (self._height, self._size[1] - self._height)
        self._draw.text(at, text, fill=_VERTEX, font=self._font, anchor="lm")
