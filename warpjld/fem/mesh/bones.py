"""Bones in a mesh: selection of their elements, and fitting of nodes to their surfaces.

Elements of a regular grid approximate a bone by stairs: the depth of the flesh over it is wrong by up to half an
element, and so are its forces where only two or three elements lie between bone and skin. So nodes between bone and
flesh are moved to the bone's surface, as those of the skin are to the skin's.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.mesh.untangle import as_far, improve

__all__ = ["Bone", "claimed", "fitted"]

_PULLS = (10.0, 30.0)
"""Weights of squared distances from the bones' surfaces, per squared spacing, in successive passes."""
_ROUNDS = 40  # largest number of iterations of fitting
_LEAST = 0.2
"""Smallest scaled Jacobian; nodes stay off the bones where it, or a smaller initial one, would not be kept."""
_ALONG = 100
"""Number of points of a bone's axis for which the nearest elements are searched."""
_SHORTER = 0.5
"""Factor by which the displacement of nodes of bad elements is repeatedly reduced."""
_SLIDE = 0.02  # weight of tangential distance, per normal distance: nodes slide along a bone
_END = 0.7
"""Smallest cosine between the bone's direction and the normals of faces of its ends."""


@dataclass(frozen=True, eq=False)
class Bone:
    """A round shaft with flat ends, possibly bent and tapered.

    Attributes:
        start: Point at share 0 [m], shape (3,).
        along: Vector from share 0 to share 1 [m], shape (3,).
        shift: Offset of the axis from that line at K equidistant shares from 0 to 1 [m], shape (K, 3).
        radius: Radius at these shares [m], shape (K,).
        near: Share at the proximal end.
        far: Share at the distal end.
    """

    start: Array
    along: Array
    shift: Array
    radius: Array
    near: float
    far: float

    @property
    def length(self) -> float:
        """Length from share 0 to 1 [m]."""
        return float(np.linalg.norm(self.along))

    def around(self, points: Array) -> tuple[Array, Array, Array]:
        """Share of points (n, 3), their offset from the axis [m] (n, 3), and the radius there [m] (n,)."""
        share = (points - self.start) @ self.along / self.length**2
        t = np.linspace(0.0, 1.0, len(self.radius))
        shift = np.stack([np.interp(share, t, column) for column in self.shift.T], axis=1)
        off = points - (self.start + share[:, None] * self.along + shift)
        return share, off, np.interp(share, t, self.radius)

    def depth(self, points: Array) -> Array:
        """Distance of points (n, 3) from the axis per radius; infinite beyond the ends."""
        share, off, radius = self.around(points)
        inside = (share > self.near) & (share < self.far)
        return np.where(inside, np.linalg.norm(off, axis=1) / np.maximum(radius, 1e-12), np.inf)

    def threaded(self, mesh: HexMesh, chosen: NDArray[np.integer]) -> NDArray[np.integer]:
        """Those of chosen elements that are nearest to points of the axis, with centres between the bone's ends."""
        middles = mesh.nodes[mesh.elements[chosen]].mean(axis=1)
        inside = np.isfinite(self.depth(middles))
        chosen, middles = chosen[inside], middles[inside]
        if not len(chosen):
            return chosen
        share = np.linspace(self.near, self.far, _ALONG)
        t = np.linspace(0.0, 1.0, len(self.radius))
        shift = np.stack([np.interp(share, t, column) for column in self.shift.T], axis=1)
        away, found = cKDTree(middles).query(self.start + share[:, None] * self.along + shift)
        near = away < 2.0 * np.interp(share, t, self.radius)
        return np.unique(chosen[found[near]])


def claimed(mesh: HexMesh, bones: Sequence[Bone], bare: Collection[int] = ()) -> Ints:
    """Bone that contains each element's centre, the nearest of several, -1 in flesh, shape (E,).

    Elements of the outermost layer are flesh: every bone is covered by skin. If the elements are so large that none has
    its centre in a bone, the bone consists of the elements nearest to its axis.

    Args:
        mesh: The mesh.
        bones: Their shapes.
        bare: Bones that may contain elements of the outermost layer, too.
    """
    middles = mesh.nodes[mesh.elements].mean(axis=1)
    below = np.ones(len(middles), dtype=bool)
    below[mesh.boundary()[:, 0]] = False
    core = np.flatnonzero(below)
    nearest = np.full(len(middles), np.inf)
    owner = np.full(len(middles), -1)
    for number, bone in enumerate(bones):
        depth = bone.depth(middles)
        depth[(depth >= 1.0) | ~(below | (number in bare))] = np.inf
        depth[bone.threaded(mesh, core)] = 0.0
        mine = depth < nearest
        nearest[mine], owner[mine] = depth[mine], number
    return owner


def fitted(mesh: HexMesh, elements: Mapping[int, Ints32], bones: Mapping[int, Bone], spacing: float) -> HexMesh:
    """The mesh with nodes between bones and flesh moved to the bones' surfaces, as far as element quality permits.

    Nodes on the mesh's boundary stay. A bone of few elements is a prism with few sides: its radius is chosen such that
    its section has the area of the round bone's.

    Args:
        mesh: Mesh that is already fitted to its surface.
        elements: Corners of each bone's elements, shape (n, 8).
        bones: Their shapes, under the same keys.
        spacing: Edge length of the elements [m].
    """
    if not elements:
        return mesh
    still = np.zeros(len(mesh.nodes), dtype=bool)
    still[mesh.quads(mesh.boundary())] = True
    hulls = [_Hull.of(mesh, own, bones[key], spacing, still) for key, own in elements.items()]
    number = np.concatenate([hull.nodes for hull in hulls])
    nodes = mesh.nodes
    for pull in _PULLS:
        targets, normals, slides = (np.concatenate(x) for x in zip(*(h.wanted(nodes) for h in hulls), strict=True))
        nodes = improve(
            nodes,
            mesh.elements,
            spacing,
            number,
            targets,
            normals,
            pull=np.full(len(number), pull),
            slide=slides,
            softness=0.03,
            rounds=_ROUNDS,
            still=still,
        )
    nodes[still] = mesh.nodes[still]  # remove rounding errors
    goal = nodes.copy()
    goal[number] = np.concatenate([hull.wanted(nodes)[0] for hull in hulls])
    least = np.minimum(_LEAST, mesh.scaled_jacobian())
    nearer = as_far(mesh, nodes, goal, least, _SHORTER).nodes
    return as_far(mesh, mesh.nodes, nearer, least, _SHORTER)


@dataclass(frozen=True, eq=False)
class _Hull:
    """Nodes between a bone and flesh.

    Attributes:
        bone: The bone.
        nodes: The nodes that may move, shape (n,).
        side: Mask of those on the lateral surface, shape (n,).
        end: Share of the end that they lie on, NaN elsewhere, shape (n,).
        quads: Faces of the lateral surface, shape (F, 4).
    """

    bone: Bone
    nodes: Ints
    side: Mask
    end: Array
    quads: Ints32

    @staticmethod
    def of(mesh: HexMesh, own: Ints32, bone: Bone, spacing: float, still: Mask) -> _Hull:
        """The hull of a bone's elements, given by their nodes (n, 8); ``still`` nodes are left out."""
        part = HexMesh(mesh.nodes, own, np.zeros(len(own), np.int32))
        quads = part.quads(part.boundary())
        x = mesh.nodes[quads]
        normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
        cosine = normal @ bone.along / (np.linalg.norm(normal, axis=1) * bone.length)
        share = (x.mean(axis=1) - bone.start) @ bone.along / bone.length**2
        reach = 0.8 * spacing / bone.length
        near = (cosine < -_END) & (share < share.min() + reach)
        far = (cosine > _END) & (share > share.max() - reach)
        side = np.zeros(len(mesh.nodes), dtype=bool)
        side[quads[~near & ~far]] = True
        end = np.full(len(mesh.nodes), np.nan)
        end[quads[near]] = bone.near
        end[quads[far]] = bone.far
        nodes = np.unique(quads).astype(np.int64)
        nodes = nodes[~still[nodes]]
        return _Hull(bone, nodes, side[nodes], end[nodes], quads[~near & ~far])

    def wanted(self, nodes: Array) -> tuple[Array, Array, Array]:
        """Target positions of the nodes [m] (n, 3), normals there (n, 3), and relative tangential weights (n,)."""
        bone = self.bone
        x = nodes[self.nodes]
        share, off, radius = bone.around(x)
        size = np.linalg.norm(off, axis=1)
        outwards = off / np.maximum(size, 1e-12)[:, None]
        stretch = self._stretch(nodes)
        target = x + np.where(self.side, stretch * radius - size, 0.0)[:, None] * outwards
        at_end = ~np.isnan(self.end)
        target += np.where(at_end, self.end - share, 0.0)[:, None] * bone.along
        normal = np.where(self.side[:, None], outwards, bone.along / bone.length)
        return target, normal, np.where(self.side & at_end, 1.0, _SLIDE)

    def _stretch(self, nodes: Array) -> float:
        """Factor for the radius, so that the section of flat faces has the mean area of the round bone."""
        corners = nodes[self.quads]
        if not len(corners):
            return 1.0
        # the section's area and the angle around the axis, both as integrals over the lateral surface
        area = turn = 0.0
        for u, v in ((a, b) for a in _GAUSS for b in _GAUSS):
            shape = np.array([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
            x = np.einsum("a,fai->fi", shape, corners)
            du = (1 - v) * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 3])
            dv = (1 - u) * (corners[:, 3] - corners[:, 0]) + u * (corners[:, 2] - corners[:, 1])
            _, off, radius = self.bone.around(x)
            off -= (off @ self.bone.along)[:, None] * self.bone.along / self.bone.length**2
            flux = np.einsum("fi,fi->f", np.cross(du, dv), off)
            area += float((flux / np.maximum(radius, 1e-9) ** 2).sum())
            turn += float((flux / np.einsum("fi,fi->f", off, off)).sum())
        # relative to the nodes' own mean radius, so as not to depend on their distance from the surface
        _, off, radius = self.bone.around(nodes[self.nodes[self.side]])
        own = float(np.mean(np.linalg.norm(off, axis=1) / np.maximum(radius, 1e-9))) if self.side.any() else 1.0
        return float(np.clip(own / np.sqrt(max(area / max(turn, 1e-12), 1e-12)), 1.0, 1.3))


_GAUSS = (0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15))
"""Points of 3-point Gauss quadrature on [0, 1]."""
