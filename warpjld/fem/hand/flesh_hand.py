"""A hand as a deformable body: volume mesh, bones driven by poses, and labelled skin (R105, R110)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.bone_surfaces import BoneSurface
from warpjld.fem.contact.interface.pairs import Exclusion
from warpjld.fem.flesh import Flesh, flesh_of
from warpjld.fem.hand.blend import Moves, moves_of
from warpjld.fem.hand.labels import WEB, creases, excluded_pairs, fringes, joined_pairs, segment_name, skin_labels
from warpjld.fem.hand.regions import hand_regions
from warpjld.fem.hand.weights import bone_weights
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig
from warpjld.skeleton.kinematics import Poses, rest_poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["FleshHand", "build_flesh_hand"]


@dataclass(frozen=True, eq=False)
class FleshHand:
    """Volume mesh of a hand, driven by poses of its skeleton.

    Attributes:
        name: Prefix of its region names (see ``hand_regions``), and name of the face set of its skin.
        flesh: The mesh with its bones, and the rig's surface embedded in it.
        skeleton: The rig's rest skeleton.
        surface: The rig's surface at rest.
        place: Rigid motion of the hand as a whole from the rig's rest (see ``placed``).
        weights: Weight of each bone at every node, rows summing to one, shape (N, B).
        skin_faces: Element and local face of each skin face, shape (F, 2).
        skin_labels: Label of each skin face, shape (F,).
        label_names: ``left.index.distal``, ``left.palm.index``, ``left.wrist``, …; ``….web`` near another digit.
        excluded: Pairs of labels that are never in contact, shape (L, L) (R127).
        skin_fringes: Factor of each skin face for contact with faces of the same finger, shape (F,).
    """

    name: str
    flesh: Flesh
    skeleton: Skeleton
    surface: Surface
    place: Moves
    weights: NDArray[np.float64]
    skin_faces: NDArray[np.int32]
    skin_labels: NDArray[np.int32]
    label_names: tuple[str, ...]
    excluded: NDArray[np.bool_]
    skin_fringes: NDArray[np.float64]

    @property
    def mesh(self) -> HexMesh:
        """Its mesh. When merged with others, it must come first, so that its node indices stay valid."""
        return self.flesh.mesh

    @cached_property
    def segments(self) -> tuple[str, ...]:
        """Name of each bone's segment, as in ``label_names``."""
        return tuple(segment_name(self.skeleton.names[joint]) for joint in self.flesh.bones)

    @cached_property
    def bone_nodes(self) -> tuple[NDArray[np.int32], ...]:
        """Nodes of each bone."""
        return tuple(self.mesh.node_sets[name] for name in self.flesh.names)

    @cached_property
    def node_labels(self) -> NDArray[np.int32]:
        """Label of every skin node, -1 inside, shape (N,): the most frequent among its faces, where webs count as their
        segment."""
        plain = np.array([self.label_names.index(name.removesuffix(WEB)) for name in self.label_names])
        votes = np.zeros((len(self.mesh.nodes), len(self.label_names)), np.int32)
        np.add.at(votes, (self.mesh.quads(self.skin_faces), plain[self.skin_labels][:, None]), 1)
        return np.where(votes.any(axis=1), votes.argmax(axis=1), -1).astype(np.int32)

    def self_contact(self) -> Exclusion:
        """Parts of the skin that are excluded from self-contact (R126, R127)."""
        names = self.skeleton.names
        ends = [[names[joint] for joint in joints] for joints in (self.flesh.bones, self.flesh.parents)]
        labels, joined = self.skin_labels, joined_pairs(self.label_names, *ends)
        return Exclusion(labels, labels, self.excluded, joined, self.skin_fringes)

    def moves(self, poses: Poses, frame: int = 0) -> Moves:
        """Rigid motion of every bone from its rest position."""
        self._check(poses)
        return self.place.to(moves_of(poses, frame, self.flesh.parents, self.skeleton.rest))

    def rest_pose(self) -> Poses:
        """The pose without displacements."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_quat(self.place.turns[0])
        rest = rest_poses(self.skeleton)
        turns = np.tile(self.place.turns[0], (1, len(self.skeleton), 1))
        return Poses((turn.apply(self.skeleton.rest) + self.place.shifts[0])[None], turns, rest.flexion)

    def skin(self, displacement: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """The rig's surface, deformed by ``displacement`` (N, 3) or at rest [m], shape (V, 3) (R104)."""
        from scipy.spatial.transform import Rotation

        out = Rotation.from_quat(self.place.turns[0]).apply(self.surface.vertices) + self.place.shifts[0]
        moved: NDArray[np.float64] = out if displacement is None else out + self.flesh.skin.carry(displacement)
        return moved

    def prescribed(self, poses: Poses, frame: int = 0) -> Prescribed:
        """Displacements from rest of every bone's nodes in a pose (R110)."""
        return self.prescribed_by(self.moves(poses, frame))

    def prescribed_by(self, moves: Moves) -> Prescribed:
        """Displacements from rest of every bone's nodes under rigid motions of the bones."""
        nodes = np.concatenate(self.bone_nodes)
        x = self.mesh.nodes[nodes]
        owner = np.repeat(np.arange(len(self.bone_nodes)), [len(n) for n in self.bone_nodes])
        moved = moves.of(owner, x) - x
        order = np.argsort(nodes, kind="stable")
        degrees = (3 * nodes[order].astype(np.int64)[:, None] + np.arange(3)).ravel()
        return Prescribed(degrees, moved[order].ravel())

    def guess(
        self, before: Moves, after: Moves, displacement: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Initial guess of the displacement after a step: bones exact, flesh by blended motion [m], shape (N, 3).

        Args:
            before: Motion of the bones before the step.
            after: Motion of the bones after it.
            displacement: Displacement of all nodes before the step; by default what the blended motion gives from rest.
                Rows beyond this hand's nodes (of bodies merged after it) are kept.
        """
        count = len(self.mesh.nodes)
        if displacement is None:
            out = np.zeros((count, 3))
            before = before.still()
        else:
            out = np.array(displacement, dtype=np.float64).reshape(-1, 3)
        rest = self.mesh.nodes
        out[:count] = before.to(after).blended(self.weights, rest + out[:count]) - rest
        known = self.prescribed_by(after)
        out.reshape(-1)[known.degrees] = known.values
        return out

    def placed(self, poses: Poses, frame: int = 0) -> FleshHand:
        """The same hand with its rest moved rigidly to the root of a pose, so that no step has to do this."""
        self._check(poses)
        root = int(np.flatnonzero(self.skeleton.parents < 0)[0])
        whole = moves_of(poses, frame, [root], self.skeleton.rest)
        place = Moves(np.repeat(whole.turns, len(self.bone_nodes), 0), np.repeat(whole.shifts, len(self.bone_nodes), 0))
        first = np.zeros(len(self.mesh.nodes), np.int64)
        nodes = whole.of(first, self.place.to(self.place.still()).of(first, self.mesh.nodes))
        mesh = replace(self.mesh, nodes=nodes)
        return replace(self, flesh=replace(self.flesh, mesh=mesh), place=place)

    def _check(self, poses: Poses) -> None:
        if poses.positions.shape[1:] != (len(self.skeleton), 3):
            raise InputError(f"poses: want {len(self.skeleton)} joints, got {poses.positions.shape[1]}")


def build_flesh_hand(
    rig: Rig,
    spacing: float = 0.003,
    *,
    name: str = "hand",
    skin: float = 1.5e-3,
    bone: float = 0.45,
    flush: float = 0.4,
    gap: float = 0.2,
    head: float = 0.03,
    least: float = 0.1,
    apart: float = 2.5,
    bones: Sequence[BoneSurface] = (),
) -> FleshHand:
    """Mesh a hand and prepare it to be driven by poses.

    Args:
        rig: Surface and skeleton.
        spacing: Edge length of the elements [m]. An index finger pressed 2.7 mm onto a plate gives 2.66, 2.57, 2.34,
            2.47, 3.24, 2.39 and 0.62 N at 1.5, 2.2, 2.6, 3, 3.5, 4 and 5 mm (``examples/flesh_sizes.py``): above 3 mm
            for previews only, see ``coarse_note``.
        name: Prefix of region names, and name of the face set of the skin.
        skin: Depth of the skin [m]; elements that it fills partly have mixed stiffness.
        bone: Radius of a bone, per depth of its segment under the skin.
        flush: Shift of the bone towards the back, per that depth.
        gap: Share of a segment that is left soft at its proximal end and at fingertips: in a flexed joint the flesh
            between the bones has to stretch.
        head: Share that is left soft at its distal end: the head of the bone forms the knuckle.
        least: Smallest scaled Jacobian.
        apart: Skin closer at rest to another digit than this many spacings is web, which is excluded from contact with
            skin as close as that.
        bones: Surfaces of bones, which replace the default cylinders along their segments.

    Raises:
        InputError: A surface or spacing that cannot be meshed.
    """
    flesh = flesh_of(rig, spacing, bone=bone, flush=flush, gap=gap, head=head, least=least, bones=bones)
    mesh = flesh.mesh
    faces = mesh.boundary()
    joints = [rig.skeleton.names[j] for j in flesh.bones]
    weights = bone_weights(mesh, [mesh.node_sets[n] for n in flesh.names])
    regions, region_names = hand_regions(mesh, name, rig.surface, skin, weights, joints, flesh.bones, flesh.parents)
    mesh = replace(mesh, regions=regions, region_names=region_names, faces={name: faces})
    flesh = replace(flesh, mesh=mesh)
    labels, names = skin_labels(mesh, faces, weights, joints, apart * spacing)
    parents = [rig.skeleton.names[j] for j in flesh.parents]
    joined, folds = joined_pairs(names, joints, parents), creases(names, joints, parents)
    excluded = excluded_pairs(mesh, faces, labels, names, 0.5 * apart * spacing, joined, folds)
    place = Moves(np.tile([0.0, 0.0, 0.0, 1.0], (len(joints), 1)), np.zeros((len(joints), 3)))
    fringe = fringes(mesh, faces, labels, names, apart * spacing, folds)
    return FleshHand(name, flesh, rig.skeleton, rig.surface, place, weights, faces, labels, names, excluded, fringe)
