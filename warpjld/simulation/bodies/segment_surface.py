"""The skin of some segments of a body, so that only their flesh is meshed (R105, R126).

A whole body in elements of a centimetre has a hundred thousand of them, two segments of an arm some thousand. The skin
is cut a little beyond the segments; where it is open there, the mesh ends, and is held by the bones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.mesh.embedding import Embedding
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig
from warpjld.skeleton.segments import segment_joints

__all__ = ["SegmentSurface", "segment_surface"]

_MARGIN = 4.0
"""Skin that is meshed beyond the segments, in elements: that far the flesh gives way less and less."""
_RIM = 0.3
"""Distance from the skin, in elements, from which on a node of the mesh's boundary lies where it was cut off."""


@dataclass(frozen=True, eq=False)
class SegmentSurface:
    """The skin of some segments of a rig.

    Attributes:
        rig: The rig with this skin only, open where it was cut off.
        whole: The skin of the whole rig.
        vertices: Rows of its vertices there, shape (v,).
        share: How far they belong to the segments, falling to 0 where the skin was cut off, shape (V,).
        joints: That the segments begin at.
    """

    rig: Rig
    whole: Surface
    vertices: NDArray[np.int64]
    share: NDArray[np.float64]
    joints: frozenset[int]

    def widened(self, hand: FleshHand) -> FleshHand:
        """A mesh of this skin as that of the whole rig: vertices beyond it have weights of 0."""
        small, count = hand.flesh.skin, len(self.whole.vertices)
        corners = np.zeros((count, 8), np.int32)
        weights, outside = np.zeros((count, 8)), np.zeros(count)
        corners[self.vertices], weights[self.vertices] = small.corners, small.weights
        outside[self.vertices] = small.outside
        flesh = replace(hand.flesh, skin=Embedding(corners, weights, outside))
        return replace(hand, flesh=flesh, surface=self.whole)

    def bones(self, hand: FleshHand) -> NDArray[np.bool_]:
        """Bones of the segments among those of a mesh, shape (B,)."""
        return np.array([parent in self.joints for parent in hand.flesh.parents])

    def ends(self, hand: FleshHand, spacing: float) -> NDArray[np.int64]:
        """Nodes of a mesh at the rig's rest where this skin was cut off."""
        from warpjld.fem.contact.obstacles.facets import Facets

        outer = np.unique(hand.mesh.quads(hand.skin_faces))
        surface = self.rig.surface
        found = Facets(surface.vertices, surface.faces).project(hand.mesh.nodes[outer])
        away = np.linalg.norm(hand.mesh.nodes[outer] - found.closest, axis=1)
        return outer[away > _RIM * spacing].astype(np.int64)

    def gap(self, hand: FleshHand, skin: NDArray[np.float64], ends: NDArray[np.int64]) -> float:
        """Greatest distance of a posed mesh's skin nodes, its ends apart, from the rig's skin there (V, 3) [m]."""
        from warpjld.fem.contact.obstacles.facets import Facets

        outer = np.setdiff1d(np.unique(hand.mesh.quads(hand.skin_faces)), ends)
        there = Facets(skin[self.vertices], self.rig.surface.faces).project(hand.mesh.nodes[outer])
        return float(np.linalg.norm(hand.mesh.nodes[outer] - there.closest, axis=1).max(initial=0.0))


def segment_surface(rig: Rig, covering: Covering, segments: Sequence[str], spacing: float) -> SegmentSurface:
    """The skin of named segments (``segment_joints`` has the words), and a margin around it.

    Args:
        rig: Surface and skeleton.
        covering: Its skin bound to its skeleton.
        segments: Their names.
        spacing: Edge length of the elements [m].

    Raises:
        InputError: The skeleton has no such segment, or no skin belongs to it.
    """
    skeleton, surface = rig.skeleton, rig.surface
    joints = {joint for name in segments for joint in segment_joints(skeleton, name)}
    words = {skeleton.names[joint] for joint in joints}
    sides = [
        side for side in ("left", "right") if any(word.startswith(f"{side}.") and ".knuckle" in word for word in words)
    ]
    palms = {f"{side}.{part}" for side in sides for part in ("palm", "carpus")}
    mine = np.array([fan.name in words | palms for fan in covering.fans])
    inside = covering.domains[:, mine].sum(axis=1) > 0.5
    if not inside.any():
        raise InputError(f"no skin belongs to {', '.join(segments)}")
    margin = _MARGIN * spacing
    away = _way_over_skin(surface, inside, margin)
    chosen = np.flatnonzero(away <= margin)
    share = np.clip(1.0 - away / margin, 0.0, 1.0)
    number = np.full(len(surface.vertices), -1, np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    faces = number[surface.faces]
    faces = faces[(faces >= 0).all(axis=1)]
    used = np.unique(faces)
    chosen, again = chosen[used], np.full(len(chosen), -1, np.int32)
    again[used] = np.arange(len(used), dtype=np.int32)
    part = Surface(surface.vertices[chosen], again[faces], np.arange(len(chosen), dtype=np.int32), again[faces])
    small = replace(rig, surface=part, skin=None, rigid=None if rig.rigid is None else rig.rigid[chosen])
    share[np.setdiff1d(np.arange(len(share)), chosen)] = 0.0
    return SegmentSurface(small, surface, chosen, share * share * (3.0 - 2.0 * share), frozenset(joints))


def _way_over_skin(surface: Surface, start: NDArray[np.bool_], limit: float) -> NDArray[np.float64]:
    """Length of the way along edges from the nearest of some vertices [m], infinite beyond ``limit``, shape (V,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    edges = np.unique(np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(surface.vertices[edges[:, 0]] - surface.vertices[edges[:, 1]], axis=1)
    count = len(surface.vertices)
    graph = coo_array((length + 1e-12, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    way = dijkstra(graph, directed=False, indices=np.flatnonzero(start), limit=limit, min_only=True)
    return np.asarray(way, np.float64)
