"""Cache of flesh meshes on disk: meshing takes many seconds, reading a mesh about 0.1 s."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.bone_surfaces import BoneSurface, SurfaceBone
from warpjld.fem.flesh import Flesh
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.cushion import Cushion, cushions
from warpjld.fem.hand.flesh_hand import FleshHand, build_flesh_hand
from warpjld.fem.mesh.bones import Bone
from warpjld.fem.mesh.embedding import Embedding
from warpjld.fem.mesh.fit import Fit
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.files.kept_values import hash_of, kept_value
from warpjld.rig import Rig
from warpjld.simulation.bodies.kept_sources import MESHING
from warpjld.simulation.bodies.rest_shape import rest_in_pose
from warpjld.skeleton import Poses

__all__ = ["RestingFlesh", "resting_flesh"]


@dataclass(frozen=True, eq=False)
class RestingFlesh:
    """A hand's flesh mesh at the rig's rest and in the pose at which contact begins.

    Attributes:
        built: Hand as meshed, at the rig's rest.
        hand: Hand in the pose, which is its stress-free reference configuration.
        gap: Largest distance of the mesh's skin nodes from the skin in the pose [m].
        cushions: Thickness of the flesh under the phalanges, at the rig's rest.
        notes: Messages about cache files that could not be used.
    """

    built: FleshHand
    hand: FleshHand
    gap: float
    cushions: tuple[Cushion, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Meshed:
    """Fields of a ``FleshHand`` that cannot be taken from its rig."""

    flesh: Flesh
    place: Moves
    weights: NDArray[np.float64]
    skin_faces: NDArray[np.int32]
    skin_labels: NDArray[np.int32]
    label_names: tuple[str, ...]
    excluded: NDArray[np.bool_]
    skin_fringes: NDArray[np.float64]
    cushions: tuple[Cushion, ...]


@dataclass(frozen=True, eq=False)
class _Posed:
    """Fields of a mesh that depend on the pose, and its largest distance from the skin [m]."""

    nodes: NDArray[np.float64]
    node_sets: dict[str, NDArray[np.int32]]
    gap: float


_CLASSES = (_Meshed, Flesh, HexMesh, Bone, SurfaceBone, BoneSurface, Embedding, Fit, Moves, Cushion)
"""Record types that the cache file of a mesh may contain."""
_SHARED = ("place", "weights", "skin_faces", "skin_labels", "label_names", "excluded", "skin_fringes")
"""Fields that ``FleshHand`` and ``_Meshed`` have in common."""


def resting_flesh(
    rig: Rig,
    element: float,
    name: str,
    poses: Poses,
    skin: NDArray[np.float64],
    bones: Sequence[BoneSurface] = (),
) -> RestingFlesh:
    """Flesh of a rig, meshed at its rest and carried to a pose; read from the cache if it is there.

    Args:
        rig: Surface and skeleton.
        element: Edge length of the elements [m].
        name: See ``build_flesh_hand``.
        poses: The pose (a batch of one).
        skin: Its surface in that pose [m], shape (V, 3).
        bones: Surfaces of its bones, if there are any; other bones are cylinders.

    Raises:
        InputError: It cannot be meshed, or not in that pose.
    """

    def mesh() -> _Meshed:
        hand = build_flesh_hand(rig, element, name=name, bones=bones)
        parts = {part: getattr(hand, part) for part in _SHARED}
        return _Meshed(flesh=hand.flesh, cushions=cushions(hand), **parts)

    shapes = tuple((one.name, one.vertices, one.faces) for one in bones)
    key = hash_of(rig.surface.vertices, rig.surface.faces, rig.skeleton, element, name, shapes)
    meshed, notes = kept_value("flesh", key, _CLASSES, mesh, modules=MESHING)
    parts = {part: getattr(meshed, part) for part in _SHARED}
    built = FleshHand(name=name, flesh=meshed.flesh, skeleton=rig.skeleton, surface=rig.surface, **parts)

    def pose() -> _Posed:
        hand, gap = rest_in_pose(built, poses, skin)
        return _Posed(hand.mesh.nodes, hand.mesh.node_sets, gap)

    key = hash_of(key, poses, skin)
    posed, more = kept_value("rest", key, (_Posed,), pose, modules=MESHING)
    moved = replace(built.mesh, nodes=posed.nodes, node_sets=posed.node_sets)
    hand = replace(built, flesh=replace(built.flesh, mesh=moved))
    return RestingFlesh(built, hand, posed.gap, meshed.cushions, (*notes, *more))
