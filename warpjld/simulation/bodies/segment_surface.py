"""Skin of selected segments of a body, so that only their flesh is meshed (R105, R126).

A whole body meshed with elements of 1 cm has about a hundred thousand, two segments of an arm a few thousand. The skin
is cut a margin beyond the segments; the mesh ends at this cut, and is held by the bones there.
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
from warpjld.geometry.edge_distance import edge_distance, edge_graph
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig
from warpjld.skeleton.segments import segment_joints

__all__ = ["SegmentSurface", "segment_surface"]

_MARGIN = 4.0
"""Width of the skin meshed beyond the segments, in elements; the share of deformation falls to 0 over it."""
_RIM = 0.3
"""Distance from the skin, in elements, beyond which a node of the mesh's boundary belongs to the cut."""


@dataclass(frozen=True, eq=False)
class SegmentSurface:
    """Skin of selected segments of a rig.

    Attributes:
        rig: The rig with this part of the skin only, open at the cut.
        whole: Skin of the whole rig, V vertices.
        vertices: Indices of the part's vertices in ``whole``, shape (v,).
        share: Weight of each vertex of ``whole``: 1 on the segments, falling to 0 at the cut, shape (V,).
        joints: Joints at the proximal ends of the segments.
    """

    rig: Rig
    whole: Surface
    vertices: NDArray[np.int64]
    share: NDArray[np.float64]
    joints: frozenset[int]

    def widened(self, hand: FleshHand) -> FleshHand:
        """Flesh mesh of this part, embedded in the whole rig's skin: vertices outside the part have weights of 0."""
        part, count = hand.flesh.skin, len(self.whole.vertices)
        corners = np.zeros((count, 8), np.int32)
        weights, outside = np.zeros((count, 8)), np.zeros(count)
        corners[self.vertices], weights[self.vertices] = part.corners, part.weights
        outside[self.vertices] = part.outside
        flesh = replace(hand.flesh, skin=Embedding(corners, weights, outside))
        return replace(hand, flesh=flesh, surface=self.whole)

    def bones(self, hand: FleshHand) -> NDArray[np.bool_]:
        """Mask of the mesh's bones that belong to the segments, shape (B,)."""
        return np.array([parent in self.joints for parent in hand.flesh.parents])

    def ends(self, hand: FleshHand, spacing: float) -> NDArray[np.int64]:
        """Indices of the boundary nodes of a rest mesh that lie at the cut; ``spacing``: edge of its elements [m]."""
        from warpjld.fem.contact.obstacles.facets import Facets

        outer = np.unique(hand.mesh.quads(hand.skin_faces))
        surface = self.rig.surface
        found = Facets(surface.vertices, surface.faces).project(hand.mesh.nodes[outer])
        away = np.linalg.norm(hand.mesh.nodes[outer] - found.closest, axis=1)
        return outer[away > _RIM * spacing].astype(np.int64)

    def gap(self, hand: FleshHand, skin: NDArray[np.float64], ends: NDArray[np.int64]) -> float:
        """Greatest distance of a posed mesh's skin nodes, except ``ends``, from the posed skin (V, 3) [m]."""
        from warpjld.fem.contact.obstacles.facets import Facets

        outer = np.setdiff1d(np.unique(hand.mesh.quads(hand.skin_faces)), ends)
        found = Facets(skin[self.vertices], self.rig.surface.faces).project(hand.mesh.nodes[outer])
        return float(np.linalg.norm(hand.mesh.nodes[outer] - found.closest, axis=1).max(initial=0.0))


def segment_surface(rig: Rig, covering: Covering, segments: Sequence[str], spacing: float) -> SegmentSurface:
    """Cut out the skin of named segments and a margin around it.

    Args:
        rig: Surface and skeleton.
        covering: The rig's skin bound to its skeleton.
        segments: Names of the segments, see :func:`~warpjld.skeleton.segments.segment_joints`.
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
    away = edge_distance(edge_graph(surface.vertices, surface.faces), inside, margin)
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
