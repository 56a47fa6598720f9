"""The parts of a surface that may meet: one a segment, and how thick the flesh is there."""

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

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["Patches", "half_width", "neighbours", "patches_of", "segment_distance"]

_COARSEST = 2.2  # of a part's thickness that its edges may be long
_THINNEST = 0.5  # of a part's median thickness: bones that run along the skin must not make it count as thin


@dataclass(frozen=True, eq=False)
class Patches:
    """A surface cut into parts.

    Attributes:
        faces: Triangles of the whole, shape (T, 3).
        part: Part of every vertex, shape (V,).
        names: Names of the parts.
        thickness: Depth of the flesh [m], shape (V,): to the bone, or to the middle where that is nearer.
        give: Compliance of every vertex, a number without unit: of two that meet each gives way by its share.
        joints: Pairs of parts that meet at a joint, whether or not the surface joins them.
        bones: Of every part the joints at the ends of its segments; none without a skeleton.
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
        """Which vertices an edge joins, shape (V, V)."""
        return neighbours(self.faces, len(self.part))

    @cached_property
    def shell(self) -> NDArray[np.int32]:
        """Number of the connected piece of surface that every vertex is of, shape (V,)."""
        return np.asarray(connected_components(self.linked, directed=False)[1], dtype=np.int32)

    @cached_property
    def joined(self) -> NDArray[np.bool_]:
        """Which parts are the same, share an edge or meet at a joint, shape (P, P): they meet there alone."""
        out = np.eye(len(self.names), dtype=bool)
        for a, b in self.joints:
            out[a, b] = out[b, a] = True
        corner = self.part[self.faces]
        for k in range(3):
            out[corner[:, k], corner[:, k - 1]] = out[corner[:, k - 1], corner[:, k]] = True
        return out

    def coarse(self, edge: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Parts whose edges, as long as ``edge`` [m] at every vertex, are longer than their flesh is thick, shape (P,).

        Nothing can be parted there: faces reach through the flesh from one side to the other.
        """
        ratio = edge / np.maximum(self.thickness, 1e-300)
        usual = [np.median(ratio[self.part == k]) if (self.part == k).any() else 0.0 for k in range(len(self.names))]
        return np.array(usual) > _COARSEST

    def spaced(self, vertices: NDArray[np.floating], distance: float) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Vertices that are some way apart from one another in their part, and of every vertex the nearest of them.

        Args:
            vertices: Of the surface [m], shape (V, 3).
            distance: How far apart, in parts of a part's median thickness.

        Returns:
            Which they are, and their numbers, both of shape (V,).
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
            some = rows[chosen[rows]]
            nearest[rows] = some[cKDTree(vertices[some]).query(points)[1]]
        return chosen, nearest

    def mesh(self, part: int) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Faces of a part and of one ring around it, shape (N, 3), so that what lies at the part's own border is not at
        the mesh's; and 0 for corners on the mesh's border, else 1, likewise."""
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
    """Patches of given parts."""
    usual = np.array([np.median(thickness[part == k]) if (part == k).any() else 0.0 for k in range(len(names))])
    thick = np.maximum(thickness, _THINNEST * usual[part])
    return Patches(faces, part, names, thick, np.ones(len(part)) if give is None else give, joints, bones)


def patches_of(covering: Covering) -> Patches:
    """A covering's patches: every vertex belongs to the operator that holds most of it."""
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
    """Half of how wide the flesh is under every vertex [m], shape (V,): beyond it the way out is on the other side.

    Along the inward normal, and the least of a vertex and those next to it: rays of single vertices stray.
    """
    import warp as wp
    from warpjld_kernels.touch_thickness import measure_width

    wp.init()
    points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device="cpu")
    normals = wp.array(vertex_normals(vertices, faces), dtype=wp.vec3, device="cpu")
    mesh = wp.Mesh(points, wp.array(faces.ravel(), dtype=wp.int32, device="cpu"))
    skip = 1e-5 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    width = wp.empty(len(vertices), dtype=float, device="cpu")
    wp.launch(measure_width, len(vertices), inputs=[mesh.id, points, normals, skip], outputs=[width], device="cpu")
    half = 0.5 * width.numpy().astype(np.float64)
    least = half.copy()
    for k in range(3):
        np.minimum.at(least, faces[:, k], half[faces].min(axis=1))
    return least


def segment_distance(
    points: NDArray[np.float64], joints: NDArray[np.float64], segments: list[tuple[int, int]]
) -> NDArray[np.float64]:
    """Distance of points (V, 3) to the nearest of the segments [m], shape (V,)."""
    best = np.full(len(points), np.inf)
    for a, b in segments:
        along = joints[b] - joints[a]
        square = max(float(along @ along), 1e-18)
        t = np.clip((points - joints[a]) @ along / square, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - joints[a] - t[:, None] * along, axis=1))
    return best


def neighbours(faces: NDArray[np.int32], count: int) -> csr_array:
    """Which vertices an edge joins, 1 each way, shape (V, V)."""
    i = faces[:, [0, 1, 2, 1, 2, 0]].ravel()
    j = faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    out = csr_array((np.ones(len(i)), (i, j)), shape=(count, count))
    out.data[:] = 1.0
    return out
