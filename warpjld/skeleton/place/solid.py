"""Voxel solid of any triangle soup: open at a wrist, of overlapping pieces, of any topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

__all__ = ["VoxelSolid", "capped", "solid_of"]

_SAMPLE_SPACING = 0.3  # largest spacing of surface samples, per voxel: the voxelised surface has no gaps
_MAX_VOXELS = 200_000  # largest number of voxels of a solid
_MAX_CELLS = 6_000_000  # largest number of voxels of a grid
_STEPS = [s for s in np.ndindex(3, 3, 3) if s > (1, 1, 1)]  # half of the 26 neighbours


@dataclass(frozen=True, eq=False)
class VoxelSolid:
    """The N voxels inside a surface and the graph of their 26-neighbourhoods.

    Attributes:
        points: Voxel centres, shape (N, 3).
        depth: Distance of each centre to the outside, shape (N,).
        size: Edge length of a voxel.
        graph: Steps between neighbours with their lengths, sparse, shape (N, N), each pair stored once.
    """

    points: NDArray[np.float64]
    depth: NDArray[np.float64]
    size: float
    graph: coo_matrix

    def distances(self, start: NDArray[np.integer] | int) -> NDArray[np.float64]:
        """Length of the shortest path inside the solid from the nearest start voxel; ``inf`` if unconnected."""
        return np.asarray(dijkstra(self.graph, directed=False, indices=np.atleast_1d(start), min_only=True))

    def nearest(self, place: NDArray[np.float64]) -> int:
        """Index of the voxel nearest to a place."""
        return int(((self.points - place) ** 2).sum(axis=1).argmin())

    def part(self, chosen: NDArray[np.bool_]) -> VoxelSolid:
        """The solid of the chosen voxels."""
        graph = self.graph.tocsr()[chosen][:, chosen].tocoo()
        return VoxelSolid(self.points[chosen], self.depth[chosen], self.size, graph)

    def main_piece(self) -> VoxelSolid:
        """The largest connected piece."""
        _, label = connected_components(self.graph, directed=False)
        return self.part(label == np.bincount(label).argmax())


def solid_of(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    size: float,
    *,
    low: NDArray[np.float64] | None = None,
    high: NDArray[np.float64] | None = None,
    within: VoxelSolid | None = None,
) -> VoxelSolid:
    """Voxelise the inside of a surface: what a flood fill from outside does not reach, less the outermost layer.

    Holes are capped first. Inner surfaces, as of overlapping pieces, do not divide the solid.

    Args:
        vertices: Surface, shape (V, 3).
        faces: Its triangles, shape (T, 3).
        size: Edge length of a voxel.
        low: Lowest corner of the box to voxelise, shape (3,); the whole surface by default.
        high: Its highest corner.
        within: A coarser solid of the same surface, which tells inside from outside at the box's sides where the
            surface extends beyond it.
    """
    vertices, faces = capped(vertices, faces)
    if low is None or high is None:
        low, high = vertices.min(axis=0), vertices.max(axis=0)
    shape = np.ceil((high - low) / size).astype(int) + 6
    size = float(size * max(1.0, np.prod(shape.astype(float)) / _MAX_CELLS) ** (1 / 3))
    shape = np.ceil((high - low) / size).astype(int) + 6
    origin = low - 2.5 * size
    whole = (origin - size, origin + (shape + 1) * size)
    cells = np.floor((_samples(vertices, faces, _SAMPLE_SPACING * size, *whole) - origin) / size).astype(int)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)]
    wall = np.zeros(shape, dtype=bool)
    wall[tuple(cells.T)] = True
    label, _ = ndimage.label(~wall)
    rim = np.ones(shape, dtype=bool)
    rim[1:-1, 1:-1, 1:-1] = False
    seeds = np.argwhere(rim & ~wall)
    reached = np.unique(label[tuple(seeds.T)])
    if within is not None:
        places = origin + (seeds + 0.5) * size
        away, _ = cKDTree(within.points).query(places)
        # where the surface extends beyond the box, its inside reaches the sides, too: the coarser solid covers it there
        far = np.bincount(label[tuple(seeds.T)], weights=away > 2.5 * within.size)
        reached = reached[far[reached] > 0.5 * np.bincount(label[tuple(seeds.T)])[reached]]
    outside = np.isin(label, reached) & ~wall
    solid = ndimage.binary_erosion(~outside, border_value=1)
    solid &= ~rim
    if (count := int(solid.sum())) > _MAX_VOXELS:
        coarser = size * (1.2 * count / _MAX_VOXELS) ** (1 / 3)
        return solid_of(vertices, faces, coarser, low=low, high=high, within=within)
    depth = ndimage.distance_transform_edt(~outside) * size - 0.5 * size
    return _connected(solid, depth, origin, size)


def _connected(
    solid: NDArray[np.bool_], depth: NDArray[np.float64], origin: NDArray[np.float64], size: float
) -> VoxelSolid:
    number = np.full(solid.shape, -1)
    count = int(solid.sum())
    number[solid] = np.arange(count)
    rows, columns, lengths = [], [], []
    for step in _STEPS:
        d = np.array(step) - 1
        here = tuple(slice(max(0, -k), n - max(0, k)) for k, n in zip(d, solid.shape, strict=True))
        there = tuple(slice(max(0, k), n - max(0, -k)) for k, n in zip(d, solid.shape, strict=True))
        both = solid[here] & solid[there]
        rows.append(number[here][both])
        columns.append(number[there][both])
        lengths.append(np.full(int(both.sum()), size * float(np.linalg.norm(d))))
    graph = coo_matrix((np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return VoxelSolid(origin + (np.argwhere(solid) + 0.5) * size, depth[solid], size, graph)


def capped(
    vertices: NDArray[np.float64], faces: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """The surface with a triangle fan over every hole; coincident vertices are merged."""
    scale = float(np.ptp(vertices, axis=0).max()) or 1.0
    _, first, same = np.unique(np.round(vertices / (1e-6 * scale)), axis=0, return_index=True, return_inverse=True)
    vertices, faces = vertices[first], same.ravel()[faces]
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    unique, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    rim = unique[count == 1]
    if not len(rim):
        return vertices, faces
    graph = coo_matrix((np.ones(len(rim)), (rim[:, 0], rim[:, 1])), shape=(len(vertices),) * 2)
    _, label = connected_components(graph, directed=False)
    hole = np.unique(label[rim[:, 0]], return_inverse=True)[1].ravel()
    middles = np.stack([vertices[np.unique(rim[hole == k])].mean(axis=0) for k in range(hole.max() + 1)])
    fans = np.column_stack([rim, len(vertices) + hole])
    return np.vstack([vertices, middles]), np.vstack([faces, fans])


def _samples(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    step: float,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Samples of the triangles that intersect a box, spaced by at most ``step``."""
    corners = vertices[faces]
    corners = corners[((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0)
    parts = np.minimum(np.ceil(longest / step).astype(int), 2000) + 1
    out = [corners.reshape(-1, 3)]
    for n in np.unique(parts):
        i, j = (k[np.add(*np.indices((n + 1, n + 1))) <= n] for k in np.indices((n + 1, n + 1)))
        weights = np.column_stack([i, j, n - i - j]) / n
        chosen = corners[parts == n]
        for start in range(0, len(chosen), max(1, 2_000_000 // len(weights))):
            block = chosen[start : start + max(1, 2_000_000 // len(weights))]
            out.append((weights @ block.transpose(1, 0, 2).reshape(3, -1)).reshape(-1, 3))
    return np.concatenate(out)
