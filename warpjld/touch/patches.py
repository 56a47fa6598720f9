"""Decomposition of a surface into parts that may touch, one per operator, and the thickness of their flesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.segment_distance import segment_distance
from warpjld.runtime.query_mesh import query_mesh

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["Patches", "half_width", "neighbours", "patches_of"]

_COARSEST = 2.2  # largest length of a part's edges relative to its thickness
_THINNEST = 0.5  # smallest thickness relative to the part's median, where bones run along the skin


@dataclass(frozen=True, eq=False)
class Patches:
    """A surface divided into P parts.

    Attributes:
        faces: Triangles of the whole surface, shape (T, 3).
        part: Part of every vertex, shape (V,).
        names: Names of the parts.
        thickness: Depth of the flesh [m], shape (V,): to the bone, or to the middle where that is nearer.
        give: Relative compliance of every vertex, without unit, shape (V,): two sides in contact are displaced in
            proportion to theirs.
        joints: Pairs of parts that meet at a joint, whether or not they share edges.
        bones: Joints at the ends of every part's segments; empty without a skeleton.
    """

    faces: NDArray[np.int32]
    part: NDArray[np.int32]
    names: tuple[str, ...]
    thickness: NDArray[np.float64]
    give: NDArray[np.float64]
    joints: tuple[tuple[int, int], ...] = ()
    bones: tuple[tuple[tuple[int, int], ...], ...] = ()

    @cached_property
    def linked(self) -> csr_array:
        """Adjacency matrix of the vertices, shape (V, V)."""
        return neighbours(self.faces, len(self.part))

    @cached_property
    def shell(self) -> NDArray[np.int32]:
        """Connected component of every vertex, shape (V,)."""
        return np.asarray(connected_components(self.linked, directed=False)[1], dtype=np.int32)

    @cached_property
    def joined(self) -> NDArray[np.bool_]:
        """Whether two parts are the same, share an edge or meet at a joint, shape (P, P); these are not separated."""
        out = np.eye(len(self.names), dtype=bool)
        for a, b in self.joints:
            out[a, b] = out[b, a] = True
        corner = self.part[self.faces]
        for k in range(3):
            out[corner[:, k], corner[:, k - 1]] = out[corner[:, k - 1], corner[:, k]] = True
        return out

    def coarse(self, edge: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Parts whose edges are too long for the thickness of their flesh, shape (P,).

        They cannot be separated, since faces reach through the flesh from one side to the other.

        Args:
            edge: Mean edge length at every vertex [m], shape (V,).
        """
        ratio = edge / np.maximum(self.thickness, 1e-300)
        usual = [np.median(ratio[self.part == k]) if (self.part == k).any() else 0.0 for k in range(len(self.names))]
        return np.array(usual) > _COARSEST

    def spaced(self, vertices: NDArray[np.floating], distance: float) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Choose vertices at a minimum distance from each other in each part (Poisson-disk sampling in index order).

        Args:
            vertices: Vertex positions [m], shape (V, 3).
            distance: Minimum distance relative to the part's median thickness.

        Returns:
            Mask of the chosen vertices, and the nearest chosen vertex of every vertex, both of shape (V,).
        """
        chosen, nearest = np.zeros(len(vertices), dtype=bool), np.arange(len(vertices))
        for k in range(len(self.names)):
            rows = np.flatnonzero(self.part == k)
            if not len(rows):
                continue
            points, free = np.asarray(vertices, dtype=np.float64)[rows], np.ones(len(rows), dtype=bool)
            reach, tree = distance * float(np.median(self.thickness[rows])), cKDTree(points)
            for i, point in enumerate(points):
                if free[i]:
                    free[tree.query_ball_point(point, reach)] = False
                    chosen[rows[i]] = True
            kept = rows[chosen[rows]]
            nearest[rows] = kept[cKDTree(vertices[kept]).query(points)[1]]
        return chosen, nearest

    def mesh(self, part: int) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Faces of a part with one ring around it, shape (N, 3), so that the part's border is not the mesh's boundary;
        and 0 for corners on the mesh's boundary, else 1, shape (N, 3)."""
        inside = self.part == part
        inside = inside | (self.linked @ inside.astype(float) > 0)
        faces = self.faces[inside[self.faces].all(axis=1)]
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        found, times = np.unique(edges, axis=0, return_counts=True)
        border = np.zeros(len(self.part), dtype=bool)
        border[found[times == 1].ravel()] = True
        return faces, np.where(border[faces], 0.0, 1.0).astype(np.float32)


def patches(
    faces: NDArray[np.int32],
    part: NDArray[np.int32],
    names: tuple[str, ...],
    thickness: NDArray[np.float64],
    give: NDArray[np.float64] | None = None,
    joints: tuple[tuple[int, int], ...] = (),
    bones: tuple[tuple[tuple[int, int], ...], ...] = (),
) -> Patches:
    """Patches of given parts; arguments as the attributes of :class:`Patches`, compliance 1 by default."""
    usual = np.array([np.median(thickness[part == k]) if (part == k).any() else 0.0 for k in range(len(names))])
    thick = np.maximum(thickness, _THINNEST * usual[part])
    return Patches(faces, part, names, thick, np.ones(len(part)) if give is None else give, joints, bones)


def patches_of(covering: Covering) -> Patches:
    """Patches of a covering: every vertex belongs to the operator with the largest weight."""
    part = covering.domains.argmax(axis=1).astype(np.int32)
    skeleton = covering.skeleton
    segments = [(s.proximal, s.distal) for s in skeleton.segments]
    to_bone = segment_distance(covering.surface.vertices, skeleton.rest, segments)
    ends = [(f, s.proximal, s.distal) for f, fan in enumerate(covering.fans) for s in fan.segments]
    joints = {(f, g) for f, a, b in ends for g, c, _ in ends if f != g and (c in (a, b) or skeleton.parents[c] == a)}
    return patches(
        covering.surface.faces,
        part,
        tuple(fan.name for fan in covering.fans),
        np.minimum(to_bone, half_width(covering.surface.vertices, covering.surface.faces)),
        joints=tuple(sorted(joints)),
        bones=tuple(tuple((s.proximal, s.distal) for s in fan.segments) for fan in covering.fans),
    )


def half_width(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Half of the width of the flesh beneath every vertex [m], shape (V,): at larger depths the other side is nearer.

    Measured along the inward normal; the smallest value of a vertex and its neighbours, since single rays may stray.
    """
    import warp as wp
    from warpjld_kernels.touch_thickness import measure_width

    wp.init()
    points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device="cpu")
    normals = wp.array(vertex_normals(vertices, faces), dtype=wp.vec3, device="cpu")
    mesh = query_mesh(points, faces)
    skip = 1e-5 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    width = wp.empty(len(vertices), dtype=float, device="cpu")
    wp.launch(measure_width, len(vertices), inputs=[mesh.id, points, normals, skip], outputs=[width], device="cpu")
    half = 0.5 * width.numpy().astype(np.float64)
    least = half.copy()
    for k in range(3):
        np.minimum.at(least, faces[:, k], half[faces].min(axis=1))
    return least


def neighbours(faces: NDArray[np.int32], count: int) -> csr_array:
    """Adjacency matrix of the vertices, symmetric, with entries 1, shape (V, V)."""
    i = faces[:, [0, 1, 2, 1, 2, 0]].ravel()
    j = faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    out = csr_array((np.ones(len(i)), (i, j)), shape=(count, count))
    out.data[:] = 1.0
    return out
