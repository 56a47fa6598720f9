"""Batched queries on many poses of one skin: signed distances of points, and crossings between its parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.intersections import Parts, surface_parts
from warpjld.covering.quality import closing_fans
from warpjld.grasp.objects import Places
from warpjld.grasp.triangle_tree import build_tree

__all__ = ["PosedSkins"]

_WIDTH = 8  # children of a node of the tree
_MARGIN = 4e-7  # margin of the boxes relative to the largest coordinate, against float32 rounding
_MEMORY = 64_000_000  # memory for the poses of one block [bytes]
_MOST_PARTS = 64  # bits of the masks of parts
_UNLIMITED = np.iinfo(np.int32).max  # more crossings than there can be


class PosedSkins:
    """Bounding-volume tree over the skin of a covering, refitted to any pose.

    The tree is built once at rest and refitted for every pose; it stays efficient because triangles that are close at
    rest remain close. Holes, such as at a hand's wrist, are closed by triangle fans. A point is inside where the
    winding number says so, so folds and overlapping pieces are no problem.

    Args:
        covering: The hand or body.

    Attributes:
        parts: Parts of the skin, see ``surface_parts``.
        most: Largest number of poses per batch, which bounds memory.
    """

    def __init__(self, covering: Covering) -> None:
        surface = covering.surface
        self.parts: Parts = surface_parts(covering)
        count = len(surface.vertices)
        boundary, loop = closing_fans(surface.faces)
        holes = int(loop.max()) + 1 if len(loop) else 0
        centres = [surface.vertices[boundary[loop == k, 0]].mean(axis=0) for k in range(holes)]
        rest = np.concatenate([surface.vertices, np.reshape(centres, (-1, 3))])
        fans = np.stack([boundary[:, 1], boundary[:, 0], count + loop], axis=1)
        self._faces = np.concatenate([surface.faces, fans]).astype(np.int32)
        self._part = np.concatenate([self.parts.of_face, np.full(len(fans), -1)]).astype(np.int32)
        self._points, self._skin = len(rest), count
        self._rims = [boundary[loop == k, 0] for k in range(holes)]
        self._tree = build_tree(rest, self._faces)
        self._held, self._inside = _contents(self._tree, self._part)
        self._scale = float(np.ptp(rest, axis=0).max())
        own = np.flatnonzero(self._part >= 0)
        order = own[np.argsort(self._part[own], kind="stable")]
        starts = np.searchsorted(self._part[order], np.arange(len(self.parts.names) + 1))
        self._by_part = order.astype(np.int32), starts.astype(np.int32)
        leaves, nodes = len(self._tree.face), len(self._tree.child)
        self.most = max(1, _MEMORY // (4 * (80 * leaves + 49 * nodes + 3 * len(rest))))
        self._blocks: dict[int, Any] = {}

    def fitted(self, vertices: NDArray[np.floating], places: Places) -> Any:
        """``warpjld_kernels.posed_skin.PosedSkins`` of up to ``most`` deformed skins (P, V, 3) [m].

        Their coordinates are converted to the frames ``places`` (P of them).
        """
        import warp as wp
        from warpjld_kernels.posed_skin import fit_trees

        skins = self._room(len(vertices))
        stage = wp.array(np.ascontiguousarray(vertices, np.float32), dtype=wp.vec3, device="cpu", copy=False)
        frames = [
            wp.array(np.ascontiguousarray(a), dtype=kind, device="cpu", copy=False)
            for a, kind in ((places.position, wp.vec3d), (places.rotation, wp.quatd))
        ]
        wp.launch(fit_trees, len(vertices), inputs=[stage, *frames, skins], device="cpu")
        return skins

    def least_distances(
        self,
        skins: Any,
        points: Any,
        part_of_face: NDArray[np.int32],
        gaps: NDArray[np.float64],
        *,
        near: float,
        limit: float,
        outside: bool,
    ) -> None:
        """Lower ``gaps`` (P, parts), in place, to the smallest signed distances of points to P fitted skins [m].

        Args:
            skins: From ``fitted``.
            points: ``warpjld_kernels.points_in_skins.PointGroups`` in the frames of the skins, see ``grouped_points``.
            part_of_face: Part that each triangle of the surface counts as, shape (T,).
            gaps: Distances found so far, contiguous.
            near: Points farther than this from a skin's bounding box are ignored [m].
            limit: Distances whose magnitude exceeds this are ignored [m].
            outside: Whether points outside the skin count.
        """
        import warp as wp
        from warpjld_kernels.points_in_skins import points_in_skins

        owner = np.full(len(self._faces), -1, dtype=np.int32)
        owner[: len(part_of_face)] = part_of_face
        reach = np.empty((len(gaps), _WIDTH * len(self._tree.child)), dtype=np.float32)
        wp.launch(
            points_in_skins,
            len(gaps),
            inputs=[
                skins,
                points,
                near,
                limit,
                outside,
                wp.array(owner, dtype=wp.int32, device="cpu", copy=False),
                wp.array(reach, dtype=float, device="cpu", copy=False),
                wp.array(gaps, dtype=wp.float64, device="cpu", copy=False),
            ],
            device="cpu",
        )

    def distances(
        self, skins: Any, points: NDArray[np.floating], limit: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Signed distances of points (n, 3) to the first of the fitted skins.

        Returns:
            Distances [m], infinite beyond the limit, and nearest triangles, -1 beyond the limit and T or more in the
            fans that close holes, both shape (n,).
        """
        import warp as wp
        from warpjld_kernels.posed_skin import distances_to_skin

        distance, face = np.empty(len(points)), np.empty(len(points), dtype=np.int32)
        asked = wp.array(np.ascontiguousarray(points, np.float64), dtype=wp.vec3d, device="cpu", copy=False)
        outs = [
            wp.array(a, dtype=kind, device="cpu", copy=False) for a, kind in ((distance, wp.float64), (face, wp.int32))
        ]
        wp.launch(distances_to_skin, len(points), inputs=[skins, 0, asked, limit], outputs=outs, device="cpu")
        return distance, face

    def crossings(self, vertices: NDArray[np.floating]) -> NDArray[np.int64]:
        """Number of pairs of intersecting triangles that belong to different parts.

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).

        Returns:
            Counts by pair of parts, shape (P, parts, parts), symmetric.
        """
        names = len(self.parts.names)
        found = self._crossings(vertices, np.full((len(vertices), names, names), _UNLIMITED, dtype=np.int32))
        return np.asarray(found + found.transpose(0, 2, 1), dtype=np.int64)

    def cross_more(self, vertices: NDArray[np.floating], most: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Pairs of parts with more intersecting triangles than allowed; quicker than ``crossings``.

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            most: Largest allowed number by pair of parts, symmetric, shape (P, parts, parts).

        Returns:
            Mask by pair of parts, symmetric, shape (P, parts, parts).
        """
        more = self._crossings(vertices, most) > np.triu(most, 1)
        return np.asarray(more | more.transpose(0, 2, 1))

    def part_crosses_more(
        self, vertices: NDArray[np.floating], part: NDArray[np.integer], most: NDArray[np.integer]
    ) -> NDArray[np.bool_]:
        """Skins in which one part intersects any other by more triangles than allowed, shape (P,).

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            part: The part of each skin, shape (P,).
            most: Largest allowed number with every other part, shape (P, parts).
        """
        return np.asarray((self._crossings(vertices, most, part) > most).any(axis=1))

    def _crossings(
        self, vertices: NDArray[np.floating], most: NDArray[np.integer], part: NDArray[np.integer] | None = None
    ) -> NDArray[np.int32]:
        """Counts of a part with every other (P, parts), or of all parts with later ones (P, parts, parts).

        They end beyond ``most`` (of the same shape), in the first case with the first part for which that happens.
        """
        found = [np.zeros((0, *most.shape[1:]), dtype=np.int32)]
        for first in range(0, len(vertices), self.most):
            rows = slice(first, first + self.most)
            found.append(self._crossings_of_block(vertices[rows], most[rows], None if part is None else part[rows]))
        return np.concatenate(found)

    def _crossings_of_block(
        self, vertices: NDArray[np.floating], most: NDArray[np.integer], part: NDArray[np.integer] | None
    ) -> NDArray[np.int32]:
        import warp as wp
        from warpjld_kernels.skin_crossings import count_crossings

        poses, names = len(vertices), len(self.parts.names)
        skins = self.fitted(vertices, Places.of(vertices.mean(axis=1, dtype=np.float64)))
        bits = np.uint64(1) << np.arange(min(names, _MOST_PARTS), dtype=np.uint64)
        part_of: NDArray[np.integer]
        if part is None:
            pose_of, part_of = (rows.ravel() for rows in np.indices((poses, names)))
            later = np.array([bits[k + 1 :].sum(dtype=np.uint64) for k in range(names)], dtype=np.uint64)
            others = later[part_of]
        else:
            pose_of, part_of = np.arange(poses), part
            others = bits.sum(dtype=np.uint64) - bits[part_of]
        counts = np.zeros(most.shape, dtype=np.int32)
        rows = (pose_of, part_of, others, self._by_part[1], self._by_part[0])
        kinds = (np.int32, np.int32, np.uint64, np.int32, np.int32)
        inputs = [
            wp.array(np.ascontiguousarray(a, k), device="cpu", copy=False) for a, k in zip(rows, kinds, strict=True)
        ]
        allowed, out = (
            wp.array(np.ascontiguousarray(a, np.int32).reshape(-1, names), dtype=wp.int32, device="cpu", copy=False)
            for a in (most, counts)
        )
        wp.launch(
            count_crossings,
            len(pose_of),
            inputs=[skins, *inputs, self._scale, allowed, part is not None],
            outputs=[out],
            device="cpu",
        )
        return counts

    def _room(self, count: int) -> Any:
        """Arrays for at least ``count`` poses; smaller batches reuse the arrays of the largest one so far."""
        size = 1 << max(0, count - 1).bit_length()
        if size not in self._blocks:
            self._blocks = {size: self._new(size)} if size > max(self._blocks, default=0) else self._blocks
        return self._blocks[max(self._blocks)]

    def _new(self, poses: int) -> Any:
        import warp as wp
        from warpjld_kernels import posed_skin
        from warpjld_kernels.triangle_tree import Tree

        tree, out, own = Tree(), posed_skin.PosedSkins(), self._tree
        nodes, leaves = len(own.child), len(own.face)
        step = np.arange(poses, dtype=np.int64)[:, None]
        arrays = {
            "root": (step[:, 0] * nodes, wp.int32),
            "child": (np.where(own.child < 0, own.child - step * leaves, own.child + step * nodes), wp.int32),
            "boxes": (np.tile(own.boxes.ravel(), poses), float),
            "corners": (np.tile(own.corners.ravel(), poses), float),
            "face": (np.tile(own.face.ravel(), poses), wp.int32),
        }
        for name, (values, kind) in arrays.items():
            setattr(tree, name, _on_cpu(values.ravel(), kind))
        out.tree, out.nodes, out.leaves, out.margin = tree, nodes, leaves, _MARGIN
        out.points = wp.zeros((poses, self._points), dtype=wp.vec3, device="cpu")
        out.faces = _on_cpu(self._faces, wp.vec3i)
        out.part = _on_cpu(np.where(self._part < _MOST_PARTS, self._part, -1), wp.int32)
        rims = np.concatenate([*self._rims, np.zeros(0, dtype=np.int64)])
        out.rim = _on_cpu(rims, wp.int32)
        out.first_rim = _on_cpu(np.cumsum([0, *map(len, self._rims)]), wp.int32)
        out.held = _on_cpu(self._held, wp.int32)
        out.inside = wp.array(self._inside.ravel(), dtype=wp.uint64, device="cpu")
        return out


def _on_cpu(values: NDArray, kind: Any) -> Any:
    import warp as wp

    plain = np.float32 if kind is float else np.int32
    return wp.array(np.ascontiguousarray(values, dtype=plain), dtype=kind, device="cpu")


def _contents(tree: Any, part: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.uint64]]:
    """Number of children of every node, shape (n,), and bit masks of the parts below each child, shape (n, 8)."""
    bits = np.where(part < 0, np.uint64(0), np.uint64(1) << (np.clip(part, 0, _MOST_PARTS - 1).astype(np.uint64)))
    of_leaf = np.bitwise_or.reduce(bits[tree.face], axis=1)
    held = np.zeros(len(tree.child), dtype=np.int32)
    inside = np.zeros((len(tree.child), _WIDTH), dtype=np.uint64)
    first_of_level, end = [0], 0
    while end < len(tree.child) and tree.child[end] >= 0:  # nodes are stored level by level, the root first
        end = int(tree.child[end])
        first_of_level.append(end)
    ends = [*first_of_level[1:], len(tree.child)]
    for level in range(len(ends) - 1, -1, -1):
        for node in range(first_of_level[level], ends[level]):
            child = int(tree.child[node])
            if child < 0:
                first = -1 - child
                held[node] = min(_WIDTH, len(tree.face) - first)
                inside[node, : held[node]] = of_leaf[first : first + held[node]]
            else:
                held[node] = min(_WIDTH, ends[level + 1] - child)
                below = inside[child : child + held[node]]
                inside[node, : held[node]] = np.bitwise_or.reduce(below, axis=1)
    return held, inside
