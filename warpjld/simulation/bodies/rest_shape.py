"""Reference configuration of a hand's flesh: the mesh carried to the pose at which contact begins (R91).

The mesh is generated at the rig's rest, where digits are apart, and carried to the pose by the covering: its skin nodes
move with the covered skin, its bones rigidly, and nodes in between by a harmonic field. That configuration is
stress-free: bent joints cause no spurious forces, and the first solved frame looks like the one before it. Where no
flesh is meshed, the surface is the covering's (JLD).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.mesh.harmonic import harmonic_field
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.mesh.untangle import as_far, improve
from warpjld.skeleton import Poses

__all__ = ["RestShape", "cut_to_bones", "cut_to_digits", "rest_in_pose"]

_LEAST = 0.05
"""Least scaled Jacobian of carried elements; skin nodes stay off the skin where following it would be worse."""

_GOOD = 0.15
"""Scaled Jacobian below which elements and those around them are untangled."""
_NEAR = 0.03
"""Distance of a skin node from the skin, in element edges, above which the elements around it are untangled as well."""
_RINGS = 4
"""Rings of elements around trouble that take part in untangling."""
_PULLS = (3.0, 10.0, 30.0, 30.0)
"""Weights of the squared distances of skin nodes from the skin (in element edges) in successive rounds."""
_SLIDE = 0.05
"""Weight of tangential displacement of skin nodes relative to that of their distance (``slide`` of ``improve``)."""
_FIXED = 1e4
"""Weight that keeps fixed nodes in place."""
_SHORTER = 0.6
"""Factor by which displacements of nodes of bad elements are shortened."""
_YIELDS = 3
"""How often bone nodes are released whose bones crush an element between them at a bent joint."""
_OWN = 0.5
"""Bone weight above which flesh belongs to the selected digits."""


def rest_in_pose(hand: FleshHand, poses: Poses, skin: NDArray[np.float64]) -> tuple[FleshHand, float]:
    """Carry a hand's mesh to a pose.

    Bone nodes that would crush an element between two bones are released and become flesh nodes.

    Args:
        hand: Hand as built, at the rig's rest.
        poses: The pose (a batch of one).
        skin: Its surface in that pose as the covering deforms it [m], shape (V, 3).

    Returns:
        The hand, whose ``moves`` still count from the rig's rest, and the largest distance of its mesh's skin nodes
        from that surface [m].

    Raises:
        InputError: The pose inverts elements.
    """
    moves = hand.moves(poses)
    mesh = hand.mesh
    nodes = moves.blended(hand.weights, mesh.nodes)
    bone = np.concatenate(hand.bone_nodes)
    owner = np.repeat(np.arange(len(hand.bone_nodes)), [len(n) for n in hand.bone_nodes])
    nodes[bone] = moves.of(owner, mesh.nodes[bone])

    surface = Facets(hand.surface.vertices, hand.surface.faces)
    outer = np.setdiff1d(np.unique(mesh.quads(hand.skin_faces)), bone)
    known, fixed = np.zeros_like(nodes), np.zeros(len(nodes), dtype=bool)
    known[outer] = surface.carried(mesh.nodes[outer], skin) - nodes[outer]
    fixed[outer] = fixed[bone] = True
    change = harmonic_field(mesh, known, fixed)
    moved = replace(mesh, nodes=nodes + change)
    least = min(_LEAST, 0.5 * float(mesh.scaled_jacobian().min()))
    if moved.scaled_jacobian().min() < least:
        shape = Facets(skin, hand.surface.faces)
        for _ in range(1 + _YIELDS):
            moved = _untangled(replace(mesh, nodes=nodes), change, outer, bone, shape, least)
            crushed = np.unique(mesh.elements[moved.scaled_jacobian() <= 0.0])
            if not len(crushed):
                break
            bone = np.setdiff1d(bone, crushed)
    if moved.scaled_jacobian().min() <= 0.0:
        raise InputError(
            f"flesh: {int((moved.scaled_jacobian() <= 0).sum())} elements are turned inside out where contact begins; "
            "joints are bent too far for elements of this size"
        )
    gap = float(np.abs(Facets(skin, hand.surface.faces).project(moved.nodes[outer]).distance).max())
    sets = {name: np.intersect1d(own, bone) for name, own in zip(hand.flesh.names, hand.bone_nodes, strict=True)}
    return replace(hand, flesh=replace(hand.flesh, mesh=replace(moved, node_sets=moved.node_sets | sets))), gap


def _untangled(
    mesh: HexMesh,
    change: NDArray[np.float64],
    outer: NDArray[np.integer],
    bone: NDArray[np.integer],
    skin: Facets,
    least: float,
) -> HexMesh:
    """Move nodes by ``change`` (N, 3), less where elements would fold, then untangle around the folds.

    In the untangled region skin nodes slide along the skin and inner nodes improve element quality; all others stay.
    """
    moved = as_far(mesh, mesh.nodes, mesh.nodes + change, least, _SHORTER)
    edge = float(np.median(np.linalg.norm(np.diff(mesh.nodes[mesh.elements[:, :2]], axis=1), axis=2)))
    boundary, held = np.zeros(len(mesh.nodes), dtype=bool), np.zeros(len(mesh.nodes), dtype=bool)
    boundary[outer], held[bone] = True, True
    wanted = mesh.nodes + change
    for pull in _PULLS:
        there = moved.nodes
        away = np.zeros(len(there))
        away[outer] = np.abs(skin.project(there[outer]).distance)
        trouble = away > _NEAR * edge
        trouble[np.unique(mesh.elements[moved.scaled_jacobian() < _GOOD])] = True
        if not trouble.any():
            break
        near = trouble.copy()
        for _ in range(_RINGS):
            near[np.unique(mesh.elements[near[mesh.elements].any(axis=1)])] = True
        elements = mesh.elements[near[mesh.elements].all(axis=1)]
        inside = np.zeros(len(there), dtype=bool)
        inside[elements] = True
        rim = np.zeros(len(there), dtype=bool)
        rim[mesh.elements[~near[mesh.elements].all(axis=1)]] = True
        number = np.flatnonzero(inside)
        fixed = number[(held | rim)[number]]
        free = number[(boundary & ~held & ~rim)[number]]
        found = skin.project(wanted[free])
        local = np.full(len(there), -1)
        local[number] = np.arange(len(number))
        kept = np.concatenate([free, fixed])
        nodes = there.copy()
        nodes[number] = improve(
            there[number],
            local[elements].astype(np.int32),
            edge,
            local[kept],
            np.concatenate([found.closest, there[fixed]]),
            np.concatenate([found.normal, np.tile([0.0, 0.0, 1.0], (len(fixed), 1))]),
            pull=np.concatenate([np.full(len(free), pull), np.full(len(fixed), _FIXED)]),
            slide=_SLIDE,
            softness=0.03,
        )
        nodes[fixed] = there[fixed]
        tidied = replace(mesh, nodes=nodes)
        if tidied.scaled_jacobian().min() < min(least, float(moved.scaled_jacobian().min())):
            continue
        goal = nodes.copy()
        goal[free] = skin.project(nodes[free]).closest
        moved = as_far(mesh, nodes, goal, least, _SHORTER)
    return moved


@dataclass(frozen=True, eq=False)
class RestShape:
    """Reference configuration of a hand, or of those of its digits whose flesh is meshed.

    Attributes:
        hand: Hand with the remaining nodes, faces and bones; bones keep their numbers, some have no nodes.
        start: Rigid motions of the bones from the rig's rest to time 0.
        cut: Nodes on the cut surface, which follow the bones.
        blend: Weight of the meshed flesh at every vertex of the rig's surface, 0 … 1, shape (V,); 0 without flesh.
        skin: Surface of the rig at time 0 [m], shape (V, 3).
    """

    hand: FleshHand
    start: Moves
    cut: NDArray[np.int64]
    blend: NDArray[np.float64]
    skin: NDArray[np.float64]

    def deformed(
        self,
        displacement: NDArray[np.float64],
        covered: NDArray[np.floating],
        smoothed: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda change: change,
        moves: Moves | None = None,
    ) -> NDArray[np.float64]:
        """Surface of the rig [m], shape (V, 3): displaced with the flesh (N, 3) where it is meshed, ``covered`` (V, 3)
        elsewhere, blended in between.

        Args:
            displacement: Of the nodes [m], shape (N, 3).
            covered: Surface as the covering deforms it [m], shape (V, 3).
            smoothed: Smooths what flesh adds to the motion of the bones (V, 3).
            moves: Rigid motions of the bones from the rig's rest; needed with ``smoothed``.
        """
        inside = self.blend > 0.0
        out = np.array(covered, dtype=np.float64)
        embedding = self.hand.flesh.skin
        carried = self.skin[inside] + np.einsum(
            "pa,pai->pi", embedding.weights[inside], displacement[embedding.corners[inside]]
        )
        share = self.blend[inside, None]
        if moves is None:
            out[inside] = share * carried + (1.0 - share) * out[inside]
            return out
        # smoothed as it is blended: at a cut, where elements end, what they carry counts for nothing
        base = self.start.to(moves).blended(self.skin_weights, self.skin[inside])
        change = np.zeros_like(out)
        change[inside] = share * (carried - base)
        out[inside] = share * base + (1.0 - share) * out[inside]
        return np.asarray(out + smoothed(change))

    @cached_property
    def skin_weights(self) -> NDArray[np.float64]:
        """Weights of the bones at the skin vertices with flesh, rows summing to one, shape (v, B)."""
        embedding, inside = self.hand.flesh.skin, self.blend > 0.0
        nodal = self.hand.weights[embedding.corners[inside]]
        out = np.maximum(np.einsum("pa,pab->pb", embedding.weights[inside], nodal), 0.0)
        return np.asarray(out / out.sum(axis=1, keepdims=True))


def cut_to_digits(hand: FleshHand, poses: Poses, skin: NDArray[np.float64], digits: Sequence[str] = ()) -> RestShape:
    """Restrict a posed hand (see ``rest_in_pose``) to some digits.

    Args:
        hand: Hand carried to ``poses``.
        poses: That pose.
        skin: Its surface in that pose [m], shape (V, 3).
        digits: Names, as ``index``, or ``palm``; empty for the whole hand. The thumb includes its ball (thenar), which
            touches what it grasps.

    Raises:
        InputError: No bone belongs to a digit.
    """
    if not digits:
        return RestShape(hand, hand.moves(poses), np.empty(0, np.int64), np.ones(len(skin)), skin)
    mine = np.array([bool(_digits(segment) & set(digits)) for segment in hand.segments])
    if not mine.any():
        raise InputError(f"flesh: no bone belongs to {', '.join(digits)}")
    return cut_to_bones(hand, poses, skin, mine)


def cut_to_bones(
    hand: FleshHand,
    poses: Poses,
    skin: NDArray[np.float64],
    mine: NDArray[np.bool_],
    share: NDArray[np.float64] | None = None,
    ends: NDArray[np.int64] | None = None,
) -> RestShape:
    """The flesh of some bones of a posed hand or body.

    Args:
        hand: Flesh mesh with ``poses`` as its rest state.
        poses: The pose.
        skin: Skin in this pose [m], shape (V, 3).
        mine: Mask of the bones, shape (B,).
        share: Weight of the flesh's deformation at each skin vertex, shape (V,); None: 1 everywhere.
        ends: Nodes where the mesh is cut through the flesh; they follow the bones.
    """
    start = hand.moves(poses)
    own = hand.weights[:, mine].sum(axis=1)
    mesh = hand.mesh
    kept = own[mesh.elements].max(axis=1) > _OWN
    number = np.full(len(mesh.nodes), -1)
    used = np.unique(mesh.elements[kept])
    number[used] = np.arange(len(used))
    row = np.full(len(mesh.elements), -1)
    row[kept] = np.arange(int(kept.sum()))
    inner = np.unique(mesh.elements[~kept])
    ends = np.empty(0, np.int64) if ends is None else ends
    cut = number[np.intersect1d(used, np.union1d(inner, ends))]
    faces = kept[hand.skin_faces[:, 0]]
    faces &= ~np.isin(mesh.quads(hand.skin_faces), ends).all(axis=1)
    skin_faces = np.stack([row[hand.skin_faces[faces, 0]], hand.skin_faces[faces, 1]], axis=1).astype(np.int32)
    sub = HexMesh(
        mesh.nodes[used],
        number[mesh.elements[kept]].astype(np.int32),
        mesh.regions[kept],
        mesh.region_names,
        {hand.name: skin_faces},
        {name: number[nodes[number[nodes] >= 0]].astype(np.int32) for name, nodes in mesh.node_sets.items()},
        (),
        None if mesh.lattice is None else mesh.lattice[used],
    )
    embedding = hand.flesh.skin
    corners = number[embedding.corners]
    whole = np.asarray((corners >= 0).all(axis=1))
    owned = np.einsum("pa,pa->p", embedding.weights, own[embedding.corners])
    t = np.clip((owned - _OWN - 0.05) / 0.35, 0.0, 1.0)
    blend = np.where(whole, t * t * (3.0 - 2.0 * t), 0.0) * (1.0 if share is None else share)
    flesh = replace(hand.flesh, mesh=sub, skin=replace(embedding, corners=np.where(whole[:, None], corners, 0)))
    smaller = replace(
        hand,
        flesh=flesh,
        weights=hand.weights[used],
        skin_faces=skin_faces,
        skin_labels=hand.skin_labels[faces],
        skin_fringes=hand.skin_fringes[faces],
    )
    return RestShape(smaller, start, cut, blend, skin)


def _digits(segment: str) -> set[str]:
    """Digits that a segment's flesh belongs to; the thenar, over the thumb's metacarpal, to both thumb and palm."""
    *before, last = segment.split(".")
    return {*before, *({last} if before[-1:] == ["palm"] and last == "thumb" else ())}
