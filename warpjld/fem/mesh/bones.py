"""Bones in a mesh: which elements they take, and nodes moved onto their surfaces.

Elements of a regular grid make stairs of a bone: the flesh over it is too thin here and too thick there, by up to half
an element, and where only two or three elements lie between bone and skin its forces are wrong by as much. So nodes
between bone and flesh are moved to the bone's surface, as those of the skin are to the skin's.
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
"""Weights of distances from the bones' surfaces, in spacings squared, one after the other."""
_ROUNDS = 40  # of fitting nodes to surfaces, at most
_LEAST = 0.2
"""Least scaled Jacobian: nodes stay off the bones where they ask for worse, or for worse than it was where it was."""
_ALONG = 100
"""Points of a bone's axis from which the nearest elements are asked for."""
_SHORTER = 0.5
"""Share of their way that nodes of elements which become too bad go instead."""
_SLIDE = 0.02  # weight along the surface against 1 across it: nodes slide on a bone
_END = 0.7
"""Least cosine between a face's normal and the bone's direction at an end of the bone."""


@dataclass(frozen=True, eq=False)
class Bone:
    """A round shaft with flat ends, that may be bent and taper.

    Attributes:
        start: Where shares are counted from [m], shape (3,).
        along: To where the share is one [m], shape (3,).
        shift: Of its axis off that line at even shares from 0 to 1 [m], shape (K, 3).
        radius: There [m], shape (K,).
        near: Share at which it begins.
        far: Share at which it ends.
    """

    start: Array
    along: Array
    shift: Array
    radius: Array
    near: float
    far: float

    @property
    def length(self) -> float:
        """From share 0 to 1 [m]."""
        return float(np.linalg.norm(self.along))

    def around(self, points: Array) -> tuple[Array, Array, Array]:
        """Share of points (n, 3), where they lie off the axis [m] (n, 3), and its radius there [m] (n,)."""
        share = (points - self.start) @ self.along / self.length**2
        t = np.linspace(0.0, 1.0, len(self.radius))
        shift = np.stack([np.interp(share, t, column) for column in self.shift.T], axis=1)
        off = points - (self.start + share[:, None] * self.along + shift)
        return share, off, np.interp(share, t, self.radius)

    def depth(self, points: Array) -> Array:
        """Distance of points (n, 3) from the axis over the radius; infinite before its beginning and after its end."""
        share, off, radius = self.around(points)
        inside = (share > self.near) & (share < self.far)
        return np.where(inside, np.linalg.norm(off, axis=1) / np.maximum(radius, 1e-12), np.inf)

    def threaded(self, mesh: HexMesh, chosen: NDArray[np.integer]) -> NDArray[np.integer]:
        """Of chosen elements, those nearest to the axis along the bone whose middles lie between its ends."""
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
    """Bone that each element's middle lies in, the nearest of several, -1 in flesh, shape (E,).

    Elements of the outermost layer are flesh: there is skin over every bone. Where those below are so large that none
    has its middle in a bone, it takes those nearest to its axis.

    Args:
        mesh: The mesh.
        bones: Their shapes.
        bare: Bones that may take elements of the outermost layer, too.
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
    """The mesh with the nodes between bones and flesh on the bones' surfaces, as far as elements stay well shaped.

    Nodes on the mesh's own surface stay. A bone of few elements is a prism of few sides: its radius is what gives it
    the section of the round one.

    Args:
        mesh: Nodes on its surface already.
        elements: Corners of each bone's elements, shape (n, 8).
        bones: Their shapes, by the same numbers.
        spacing: Edge length of the elements [m].
    """
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
    nodes[still] = mesh.nodes[still]  # but for rounding they are there
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
        nodes: Those that may move, shape (n,).
        side: Which lie on its side, shape (n,).
        end: Share of the end they lie on, NaN elsewhere, shape (n,).
        quads: Faces of its side, shape (F, 4).
    """

    bone: Bone
    nodes: Ints
    side: Mask
    end: Array
    quads: Ints32

    @staticmethod
    def of(mesh: HexMesh, own: Ints32, bone: Bone, spacing: float, still: Mask) -> _Hull:
        """Of the elements of a bone, by their corners (n, 8); nodes that stay are left out."""
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
        """Where its nodes belong [m] (n, 3), normals there (n, 3), and how little they may slide (n,)."""
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
        """Radius over the round bone's that gives its side, of flat faces, the same mean section."""
        corners = nodes[self.quads]
        if not len(corners):
            return 1.0
        # the section's area and the angle it takes, both as integrals over the side
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
        # of the nodes' own mean radius, so that it does not depend on how near to the surface they are
        _, off, radius = self.bone.around(nodes[self.nodes[self.side]])
        own = float(np.mean(np.linalg.norm(off, axis=1) / np.maximum(radius, 1e-9))) if self.side.any() else 1.0
        return float(np.clip(own / np.sqrt(max(area / max(turn, 1e-12), 1e-12)), 1.0, 1.3))


_GAUSS = (0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15))
