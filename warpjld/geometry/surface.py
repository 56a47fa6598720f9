"""Triangulated surface: welded vertices for computing, and the source's own vertex order for export."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.geometry.coincident import close_links, connected_parts
from warpjld.geometry.lengths import check_reach

__all__ = ["Part", "Surface", "one_uv_a_vertex", "weld_surface"]

_NO_AREA = 1e-12  # of a triangle, per square of the surface's size: what double precision makes of a line
_SEAM = 1e-6  # relative to the surface's size: border vertices of two parts nearer than this coincide (float32 files)
_GAP = 2.5e-4
"""Relative to the surface's size: border vertices of two parts that are farther apart than this never coincide, half a
millimetre of a body: files with few decimals, and parts with frames of their own, leave such gaps."""
_OF_EDGE = 0.05  # largest gap between them per length of the shortest border edge there: none of the border is lost


@dataclass(frozen=True)
class Part:
    """One mesh of the source file: ranges of source vertices and source faces, and its base colour texture, as an
    encoded image; ``painted``: ranges of its source faces with their own textures, where it has several."""

    name: str
    vertices: slice
    faces: slice
    texture: bytes | None = field(default=None, repr=False)
    painted: tuple[tuple[slice, bytes], ...] = field(default=(), repr=False)


@dataclass(frozen=True, eq=False)
class Surface:
    """V welded vertices and T triangles, made from W source vertices (W > V where UV seams split the source).

    Attributes:
        vertices: Welded positions at rest [m], shape (V, 3).
        faces: Triangles over the welded vertices, shape (T, 3), anticlockwise seen from outside.
        weld: Welded vertex of every source vertex, shape (W,).
        source_faces: Triangles over the source vertices, shape (S, 3), in the source's order.
        uv: Texture coordinates of the source vertices, shape (W, 2), or None. Their origin is the image's lower left
            corner, as in OBJ, USD and Blender; in glTF it is the upper left one.
        corner_uv: Texture coordinates of the source faces' corners, shape (S, 3, 2), instead of ``uv`` where some
            vertex has several: the texture's seams.
        parts: The source's meshes.
        polygons: Polygon of the source that each source face is a part of, shape (S,), counted from 0 in the source's
            order, mesh after mesh; None where all are triangles.

    Users refer to vertices and facets by the source's numbers: welded vertex ``v`` is ``numbers[v]`` there, and
    ``weld`` is the map back; triangle ``t`` belongs to facet ``facets[t]`` (R133).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    weld: NDArray[np.int32]
    source_faces: NDArray[np.int32]
    uv: NDArray[np.float32] | None = None
    corner_uv: NDArray[np.float32] | None = None
    parts: tuple[Part, ...] = ()
    polygons: NDArray[np.int64] | None = None

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """First source vertex that every welded vertex was made from, shape (V,)."""
        return np.unique(self.weld, return_index=True)[1]

    @cached_property
    def source_rows(self) -> NDArray[np.int64]:
        """Source face of every triangle, shape (T,); source faces that welding made degenerate have none."""
        a, b, c = self.weld[self.source_faces].T
        return np.flatnonzero((a != b) & (b != c) & (c != a))

    @cached_property
    def facets(self) -> NDArray[np.int64]:
        """Polygon of the source that every triangle is a part of, shape (T,)."""
        return self.source_rows if self.polygons is None else self.polygons[self.source_rows]

    def __repr__(self) -> str:
        return f"Surface({len(self.vertices)} vertices, {len(self.faces)} triangles, {self.size:.3g} m across)"

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m], to which tolerances are relative."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def to_source(self, vertices: NDArray[np.float32]) -> NDArray[np.float32]:
        """Welded positions (…, V, 3) in the source's vertex order (…, W, 3)."""
        return vertices.copy() if self._welds_nothing else np.take(vertices, self.weld, axis=-2)

    @cached_property
    def _welds_nothing(self) -> bool:
        return np.array_equal(self.weld, np.arange(len(self.vertices)))

    def split_at_seams(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32] | None]:
        """Split vertices at texture seams, for file formats with one pair of texture coordinates per vertex.

        Returns:
            Source vertex of every resulting vertex, shape (N,): the source's W in their order, then copies of those on
            seams; triangles over them, shape (S, 3); their texture coordinates, shape (N, 2), or None.
        """
        count = len(self.weld)
        if self.corner_uv is None:
            return np.arange(count, dtype=np.int32), self.source_faces, self.uv
        corners = self.source_faces.ravel()
        keyed = np.column_stack([corners, self.corner_uv.reshape(-1, 2)])
        kinds, first, kind = np.unique(keyed, axis=0, return_index=True, return_inverse=True)
        vertex = corners[first]
        # sorted by vertex: the first pair of coordinates of each keeps the vertex's own index
        extra = np.concatenate([[False], vertex[1:] == vertex[:-1]])
        place = np.where(extra, count + np.cumsum(extra) - 1, vertex).astype(np.int32)
        origin = np.concatenate([np.arange(count, dtype=np.int32), vertex[extra]])
        uv = np.zeros((len(origin), 2), dtype=np.float32)
        uv[place] = kinds[:, 1:]
        return origin, place[kind.ravel()].reshape(-1, 3), uv

    def renumbered(self, order: NDArray[np.int32]) -> Surface:
        """The surface with vertices permuted, ``order[i]`` becoming the i-th; the source's order does not change."""
        place = np.empty(len(order), dtype=np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        return replace(self, vertices=self.vertices[order], faces=place[self.faces], weld=place[self.weld])


def one_uv_a_vertex(
    count: int, faces: NDArray[np.integer], corner_uv: NDArray[np.float32] | None
) -> tuple[NDArray[np.float32] | None, NDArray[np.float32] | None]:
    """Texture coordinates by vertex (count, 2) where all corners (S, 3, 2) at each vertex agree, else by corner.

    Returns:
        ``uv`` and ``corner_uv`` of a surface, one of which is None; both are where there are no coordinates.
    """
    if corner_uv is None:
        return None, None
    uv = np.zeros((count, 2), dtype=np.float32)
    uv[faces] = corner_uv
    return (uv, None) if np.array_equal(uv[faces], corner_uv) else (None, corner_uv)


def weld_surface(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    uv: NDArray[np.float32] | None = None,
    corner_uv: NDArray[np.float32] | None = None,
    parts: tuple[Part, ...] = (),
    polygons: NDArray[np.int64] | None = None,
    joins: NDArray[np.bool_] | None = None,
    tolerance: float = 1e-7,
) -> Surface:
    """Weld coincident source vertices within each part, and coincident border vertices of different parts.

    The pieces of a hand, a hand and a body, or clothes and the adjacent skin so become one connected surface, which
    deformation does not tear (R18).

    Args:
        vertices: Source positions [m], shape (W, 3).
        faces: Source triangles, shape (S, 3).
        uv: Texture coordinates, shape (W, 2).
        corner_uv: Texture coordinates of the faces' corners, shape (S, 3, 2), instead of ``uv``.
        parts: Source meshes; between different ones only border vertices are welded.
        polygons: Polygon of each source triangle, shape (S,), where the source has larger polygons.
        joins: Vertices that may be welded to another part's, shape (W,); all by default. Rigid ones may not.
        tolerance: Distance below which two vertices are welded, relative to the diagonal of the faces' bounding box.

    Raises:
        InputError: Wrong shapes, not finite, no faces with three different corners, or an index out of range.
    """
    points = np.asarray(vertices, dtype=np.float64)
    triangles = np.asarray(faces, dtype=np.int64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise InputError(f"vertices: want shape (n, 3) with n > 0, got {points.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise InputError(f"faces: want shape (n, 3) with n > 0, got {triangles.shape}")
    if not np.isfinite(points).all():
        raise InputError(f"vertices: vertex {int(np.argwhere(~np.isfinite(points))[0][0])} is not finite")
    check_reach(points, "vertices")
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError(f"faces: indices must lie in 0…{len(points) - 1}, got {triangles.min()}…{triangles.max()}")
    if not parts:
        parts = (Part("surface", slice(0, len(points)), slice(0, len(triangles))),)
    # of vertices that faces use: others may lie anywhere
    size = float(np.linalg.norm(np.ptp(points[triangles.ravel()], axis=0)))
    owner = np.arange(len(points))
    for part in parts:
        inside = points[part.vertices]
        pairs = close_links(inside, max(tolerance * size, 1e-12))
        if len(pairs):
            label = connected_parts(pairs, len(inside))
            first = np.unique(label, return_index=True)[1]
            owner[part.vertices] = part.vertices.start + first[label]
    if len(parts) > 1:
        owner = _joined_borders(points, owner[triangles], owner, parts, joins, size)
    kept, weld = np.unique(owner, return_inverse=True)
    welded = weld[triangles]
    solid = (welded[:, 0] != welded[:, 1]) & (welded[:, 1] != welded[:, 2]) & (welded[:, 2] != welded[:, 0])
    if not _has_area(points[kept], welded[solid], size):
        raise InputError("the surface is empty: it has no triangle with an area")
    return Surface(
        vertices=np.ascontiguousarray(points[kept]),
        faces=welded[solid].astype(np.int32),
        weld=weld.astype(np.int32),
        source_faces=triangles.astype(np.int32),
        uv=uv,
        corner_uv=corner_uv,
        parts=parts,
        polygons=polygons,
    )


def _has_area(points: NDArray[np.float64], faces: NDArray[np.int64], size: float) -> bool:
    """Whether any triangle is more than a line, per square of the surface's size."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return bool(area.max(initial=0.0) > _NO_AREA * size * size)


def _joined_borders(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    owner: NDArray[np.int64],
    parts: tuple[Part, ...],
    joins: NDArray[np.bool_] | None,
    size: float,
) -> NDArray[np.int64]:
    """Representative vertex of each, shape (W,), after welding the borders of different parts.

    Args:
        points: Source positions [m], shape (W, 3).
        faces: Triangles over representatives, shape (S, 3).
        owner: Representative vertex of each before that, shape (W,).
        parts: The source's meshes.
        joins: Vertices that may be welded to another part's, shape (W,); None for all.
        size: Diagonal of the surface's bounding box [m].
    """
    solid = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    half = np.sort(np.concatenate([solid[:, [0, 1]], solid[:, [1, 2]], solid[:, [2, 0]]]), axis=1)
    keys, times = np.unique(half[:, 0] * len(points) + half[:, 1], return_counts=True)
    edges = np.stack(np.divmod(keys[times == 1], len(points)), axis=1)
    border = np.unique(edges)
    if joins is not None:
        border = border[joins[border]]
    shortest = np.full(len(points), np.inf)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    np.minimum.at(shortest, edges, lengths[:, None])
    pairs = border[close_links(points[border], max(_GAP * size, 1e-12))]
    apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    pairs = pairs[apart <= np.maximum(_SEAM * size, _OF_EDGE * shortest[pairs].min(axis=1))]
    part = np.zeros(len(points), dtype=np.int64)
    for k, mesh in enumerate(parts):
        part[mesh.vertices] = k
    pairs = pairs[part[pairs[:, 0]] != part[pairs[:, 1]]]
    if not len(pairs):
        return owner
    label = connected_parts(pairs, len(points))
    first = np.unique(label, return_index=True)[1]
    return np.asarray(first[label][owner])
