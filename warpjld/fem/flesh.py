"""Volume mesh of a rig's flesh, with bones along the skeleton's segments (B §3.3 Fig. 7, R105, R110)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.fem.bone_surfaces import BoneSurface, SurfaceBone, bones_of_segments
from warpjld.fem.load.prescribed import Prescribed, prescribe
from warpjld.fem.mesh.bones import Bone, claimed, fitted
from warpjld.fem.mesh.embedding import Embedding, embed
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.fit import Fit, fit_mesh
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.geometry.segment_distance import segment_distance
from warpjld.rig import Rig
from warpjld.skeleton.kinematics import Poses

__all__ = ["Flesh", "flesh_of"]

_REACH = 3.0
"""Largest distance of the skin from the mesh, in element sizes."""
_REACH_AT_ENDS = 1.2
"""Likewise at ends of limbs: fingers of the built-in hand whose ends are left out are 1.7 off, others 1.1 at most."""


@dataclass(frozen=True, eq=False)
class Flesh:
    """Volume mesh of a rig's flesh and bones.

    Attributes:
        mesh: Regions ``flesh`` and ``bone``; each bone's nodes are a set named ``bone.`` and the joint at its far end.
        bones: Distal joint of each bone, as an index of the skeleton.
        parents: Proximal joint of each bone; the same joint for the piece behind a root.
        names: Name of each bone's node set.
        shafts: Shape of each bone.
        skin: The rig's surface, embedded in the mesh.
        fit: Mesh with quality measures.
        rest: Rest positions of the joints [m], shape (J, 3).
    """

    mesh: HexMesh
    bones: tuple[int, ...]
    parents: tuple[int, ...]
    names: tuple[str, ...]
    shafts: tuple[Bone, ...]
    skin: Embedding
    fit: Fit
    rest: Array

    def held(self, poses: Poses | None = None, frame: int = 0) -> Prescribed:
        """Prescribed displacements of all bones: zero, or moved by a pose of the skeleton (R110)."""
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        for name, parent in zip(self.names, self.parents, strict=True):
            nodes = self.mesh.node_sets[name]
            if poses is None:
                out = out + prescribe(self.mesh, nodes, x=0.0, y=0.0, z=0.0)
                continue
            turn = Rotation.from_quat(poses.rotations[frame, parent])
            x = self.mesh.nodes[nodes]
            moved = turn.apply(x - self.rest[parent]) + poses.positions[frame, parent] - x
            out = out + prescribe(self.mesh, nodes, displacement=moved)
        return out


def flesh_of(
    rig: Rig,
    spacing: float,
    *,
    bone: float = 0.45,
    flush: float = 0.4,
    gap: float = 0.08,
    head: float | None = None,
    least: float = 0.1,
    bones: Sequence[BoneSurface] = (),
) -> Flesh:
    """Mesh the inside of a rig's surface and mark its bones.

    A bone follows a segment. Its radius is a share of the depth of the flesh, and it is shifted towards the back of the
    hand (the direction of the normal, segment × flexion axis, R20), where bones lie close under the skin (R105).

    Args:
        rig: Surface and skeleton.
        spacing: Edge length of the elements [m].
        bone: Radius of a bone, per depth of its segment under the skin.
        flush: Shift towards the back, per that depth; with bone + flush = 1 the bone touches the skin.
        gap: Share of a segment at either end that is left soft, so that joints can move.
        head: Likewise at the distal end where another segment follows, ``gap`` by default; small, so that the head of
            the bone forms the knuckle.
        least: Smallest scaled Jacobian.
        bones: Surfaces of bones, which replace the default cylinders along their segments.

    Raises:
        InputError: Shares that give no bone, a surface that cannot be meshed, or no bone at this spacing.
    """
    far = gap if head is None else head
    if not 0 < bone < 1 or not 0 <= flush < 1 or not 0 <= gap < 0.5 or not 0 <= far < 0.5:
        raise InputError(f"want 0 < bone < 1, 0 ≤ flush < 1, 0 ≤ gap, head < 0.5, got {bone}, {flush}, {gap}, {far}")
    envelope = Envelope(rig.surface.vertices, rig.surface.faces)
    fit = fit_mesh(envelope, spacing, least=least, name="flesh")
    mesh = fit.mesh
    skeleton = rig.skeleton
    shafts = _shafts(rig, envelope, bone, flush, gap, far)
    own = bones_of_segments(rig, bones)
    shafts |= {joint: SurfaceBone(**vars(shafts[joint]), surface=shape) for joint, shape in own.items()}
    owner = _owner(mesh, shafts, skeleton.parents, jointed=head is not None)
    joints = [int(j) for j in np.unique(owner[owner >= 0])]
    if not joints:
        raise InputError(f"spacing: at {spacing:g} m no element fits inside a bone")
    mesh = fitted(mesh, {j: mesh.elements[owner == j] for j in joints if j not in own}, shafts, spacing)
    quality = mesh.scaled_jacobian()
    names = tuple(f"bone.{skeleton.names[j]}" for j in joints)
    sets = {n: np.unique(mesh.elements[owner == j]).astype(np.int32) for n, j in zip(names, joints, strict=True)}
    regions = (owner >= 0).astype(np.int32)
    mesh = replace(mesh, regions=regions, region_names=("flesh", "bone"), node_sets={**mesh.node_sets, **sets})
    parents = tuple(int(skeleton.parents[j]) if skeleton.parents[j] >= 0 else j for j in joints)
    fit = replace(fit, mesh=mesh, least=float(quality.min()), mean=float(quality.mean()))
    used = tuple(shafts[j] for j in joints)
    return Flesh(mesh, tuple(joints), parents, names, used, _skin(mesh, rig, spacing), fit, skeleton.rest.copy())


def _skin(mesh: HexMesh, rig: Rig, spacing: float) -> Embedding:
    """The rig's surface in the mesh.

    Raises:
        InputError: The mesh leaves out an end of a limb, as of a finger, or a thick part of anything else. A lip around
            a wrist's opening may be left out: it is thinner than any flesh that touches something.
    """
    try:
        skin = embed(mesh, rig.surface.vertices, reach=_REACH)
    except InputError as error:
        text = f"spacing: {spacing:g} m is too coarse, thin parts are not meshed ({error.message})"
        raise InputError(text) from error
    skeleton = rig.skeleton
    far = np.flatnonzero(skin.outside > _REACH_AT_ENDS)
    ends = [j for j in range(len(skeleton)) if skeleton.parents[j] >= 0]
    if not len(far) or not ends:
        return skin
    bones = [(int(skeleton.parents[j]), j) for j in ends]
    away = np.stack([segment_distance(rig.surface.vertices[far], skeleton.rest, [bone]) for bone in bones])
    for vertex, nearest in zip(far, away.argmin(axis=0), strict=True):
        if not skeleton.children[ends[nearest]]:
            raise InputError(
                f"spacing: {spacing:g} m is too coarse, thin parts are not meshed (point {vertex} at "
                f"{skeleton.names[ends[nearest]]} lies {skin.outside[vertex]:.2g} element sizes outside the mesh, more "
                f"than {_REACH_AT_ENDS:g})"
            )
    return skin


def _shafts(rig: Rig, envelope: Envelope, bone: float, flush: float, gap: float, head: float) -> dict[int, Bone]:
    """Shape of every bone, by its distal joint; arguments as in ``flesh_of``."""
    skeleton = rig.skeleton
    shafts: dict[int, Bone] = {}
    for joint, parent in enumerate(skeleton.parents):
        if parent < 0:
            # the piece behind the root (the stump of the forearm) is held with it
            parent, start = joint, skeleton.rest[joint]
            along = _behind_root(rig, envelope, joint)
        else:
            start = skeleton.rest[parent]
            along = skeleton.rest[joint] - start
        length = float(np.linalg.norm(along))
        if length == 0.0:
            continue
        t = np.linspace(0.0, 1.0, 24)
        depth = np.maximum(-envelope.ask(start + t[:, None] * along).distance, 0.0)
        back = np.cross(along / length, skeleton.axes[parent])
        size = float(np.linalg.norm(back))
        back = back / size if size > 1e-9 else np.zeros(3)
        end = 1.0 if parent == joint else 1.0 - (head if skeleton.children[joint] else gap)
        shafts[joint] = Bone(start, along, flush * depth[:, None] * back, bone * depth, gap, end)
    return shafts


def _behind_root(rig: Rig, envelope: Envelope, root: int) -> Array:
    """Vector from a root joint away from its children, to the end of the surface [m]."""
    skeleton = rig.skeleton
    children = skeleton.rest[np.asarray(skeleton.parents) == root] - skeleton.rest[root]
    away = -children.mean(axis=0) if len(children) else np.zeros(3)
    size = float(np.linalg.norm(away))
    if size == 0.0:
        return away
    steps = np.linspace(0.0, envelope.size, 400)
    inside = envelope.ask(skeleton.rest[root] + steps[:, None] * (away / size)).distance < 0.0
    reach = steps[int(np.argmin(inside))] if not inside.all() else 0.0
    out: Array = away * (reach / size)
    return out


def _owner(mesh: HexMesh, shafts: dict[int, Bone], parents: Ints32, *, jointed: bool) -> Ints:
    """Bone of every element, as its distal joint; -1 in flesh.

    In thin fingers with large elements, a bone that is covered by flesh may contain no element: it may then extend to
    the skin.
    """
    ends = np.array(list(shafts))
    bare: list[int] = []
    for _ in range(2):
        owner = claimed(mesh, list(shafts.values()), bare)
        owner = _separate_bones(mesh, np.where(owner >= 0, ends[owner], -1))
        if jointed:
            owner = _separate_at_joints(mesh, owner, parents)
        bare = np.flatnonzero(~np.isin(ends, owner)).tolist()
        if not bare:
            break
    return owner


def _separate_at_joints(mesh: HexMesh, owner: Ints, parents: Ints32) -> Ints:
    """Keep at least two elements of flesh between bones at a joint: one would have to bear the whole motion."""
    owner = owner.copy()
    for joint, parent in enumerate(parents):
        if parent < 0 or not (owner == joint).any() or not (owner == parent).any():
            continue
        own, before = (np.zeros(len(mesh.nodes), dtype=bool) for _ in range(2))
        own[mesh.elements[owner == joint]] = True
        before[mesh.elements[owner == parent]] = True
        bridge = own[mesh.elements].any(axis=1) & before[mesh.elements].any(axis=1)
        near = np.zeros(len(mesh.nodes), dtype=bool)
        near[mesh.elements[bridge]] = True
        thin = (owner == joint) & (near & own)[mesh.elements].any(axis=1)
        if not thin[owner == joint].all():
            owner[thin] = -1
    return owner


def _separate_bones(mesh: HexMesh, owner: Ints) -> Ints:
    """Assign each node to one bone at most: where bones touch, elements of the one with the larger index become
    flesh."""
    owner = owner.copy()
    first = np.full(len(mesh.nodes), np.iinfo(np.int64).max)
    bony = owner >= 0
    for corner in range(8):
        np.minimum.at(first, mesh.elements[bony, corner], owner[bony])
    clash = bony & (first[mesh.elements].min(axis=1) < owner)
    owner[clash] = -1
    return owner
