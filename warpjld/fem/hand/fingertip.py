"""A finely meshed distal segment of a digit: pulp, skin, bone and nail (R105)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.fit import Fit, fit_mesh
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.rig import Rig

__all__ = ["Fingertip", "build_fingertip"]


@dataclass(frozen=True, eq=False)
class Fingertip:
    """A fingertip, cut off at its last joint.

    Attributes:
        mesh: Regions ``tip.pulp``, ``tip.skin`` (within ``skin`` of the surface), ``tip.bone``; faces ``tip`` are the
            skin without the cut; node set ``held`` is bone, nail and cut.
        fit: Mesh with quality measures.
        along: Unit direction of the segment, towards the tip, shape (3,).
        back: Unit direction towards the nail, shape (3,).
        joint: The last joint [m], shape (3,).
        length: From the joint to the end of the skin [m].
        thickness: Pulp between bone and palmar skin at the middle of the bone [m].
    """

    mesh: HexMesh
    fit: Fit
    along: NDArray[np.float64]
    back: NDArray[np.float64]
    joint: NDArray[np.float64]
    length: float
    thickness: float

    def facing(self, tilt: float) -> NDArray[np.float64]:
        """Unit normal, outwards from the pulp, of a plate that the finger touches at an angle [rad] between plate and
        segment: 0 lies flat, π/2 stands on its tip."""
        return -np.cos(tilt) * self.back + np.sin(tilt) * self.along


def build_fingertip(
    rig: Rig,
    digit: str = "index",
    spacing: float = 0.001,
    *,
    skin: float = 1.5e-3,
    bone: tuple[float, float] = (0.3, 0.2),
    raised: float = 0.15,
    reach: float = 0.72,
    nail: float = 0.55,
) -> Fingertip:
    """Cut a fingertip off a hand's surface and mesh it.

    The bone has an elliptic section and tapers to its rounded end; its size is relative to the height of the finger at
    the joint, from nail to pulp. The defaults give a distal phalanx some 8 mm wide and 5 mm high in a finger of
    13.5 mm, over 6 mm of pulp: proportions of an adult's index finger, from memory.

    Args:
        rig: Surface and skeleton.
        digit: Digit, such as ``index`` or ``left.index``.
        spacing: Edge length of the elements [m].
        skin: Depth of the region ``tip.skin`` under the surface [m].
        bone: Half width and half height of the bone, per height of the finger.
        raised: Its shift towards the nail, per that height.
        reach: End of the bone, as a share of the length from joint to skin.
        nail: Start of the nail, as a share of that length; it covers the back from there on.

    Raises:
        InputError: No such digit, or a spacing that makes no mesh.
    """
    skeleton = rig.skeleton
    near, far = skeleton.index(f"{digit}.knuckle3"), skeleton.index(f"{digit}.tip")
    joint = skeleton.rest[near]
    along = skeleton.rest[far] - joint
    along = along / np.linalg.norm(along)
    across = skeleton.axes[near] - (skeleton.axes[near] @ along) * along
    across = across / np.linalg.norm(across)
    back = np.cross(along, across)
    vertices, faces = _cut(rig.surface.vertices, rig.surface.faces, joint, along, skeleton.rest[far])
    envelope = Envelope(vertices, faces)
    # the grid is aligned with the finger, so that rows of elements follow the bone
    frame = np.stack([across, back, along])
    fit = fit_mesh(Envelope((vertices - joint) @ frame.T, faces), spacing, name="tip.pulp")
    mesh = replace(fit.mesh, nodes=fit.mesh.nodes @ frame + joint)
    length = float(((vertices - joint) @ along).max())
    at_cut = vertices[np.abs((vertices - joint) @ along) < 0.1 * length]
    height = float(np.ptp((at_cut - joint) @ back))
    middle = mesh.nodes[mesh.elements].mean(axis=1)
    share, side, up = ((middle - joint) @ v for v in (along / length, across / height, back / height))
    bony = _in_bone(share, side, up, bone, raised, reach)
    if not bony.any():
        raise InputError(f"spacing: at {spacing:g} m no element fits inside the bone")
    depth = -envelope.ask(middle).distance
    place = (mesh.nodes - joint) @ along
    cut = np.flatnonzero(place < 0.02 * length)
    faces_ = mesh.boundary()
    corners = mesh.nodes[mesh.quads(faces_)]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    skin_faces = faces_[~np.isin(mesh.quads(faces_), cut).all(axis=1)]
    far_back = (normal @ back > 0.75) & (((corners.mean(axis=1) - joint) @ along) > nail * length)
    held = np.unique(np.concatenate([np.unique(mesh.elements[bony]), np.unique(mesh.quads(faces_[far_back])), cut]))
    regions = np.where(bony, 2, np.where(depth < skin, 1, 0)).astype(np.int32)
    mesh = replace(
        mesh,
        regions=regions,
        region_names=("tip.pulp", "tip.skin", "tip.bone"),
        faces={"tip": skin_faces},
        node_sets={"held": held.astype(np.int32)},
    )
    below = bony & (np.abs(share - 0.5 * reach) < 0.5 * spacing / length)
    lowest = (mesh.nodes[mesh.elements[below]] @ back).min() if below.any() else (joint + raised * height * back) @ back
    under = joint + 0.5 * reach * length * along
    ray = under - np.linspace(0.0, height, 400)[:, None] * back
    palm = ray[int(np.argmax(envelope.ask(ray).distance > 0.0))] @ back
    return Fingertip(mesh, fit, along, back, joint, length, float(lowest - palm))


def _in_bone(
    share: NDArray[np.float64],
    side: NDArray[np.float64],
    up: NDArray[np.float64],
    bone: tuple[float, float],
    raised: float,
    reach: float,
) -> NDArray[np.bool_]:
    """Mask of points in the bone, shape (n,): it tapers slightly and ends in a half ellipse.

    Args:
        share: Position along the phalanx, per its length; ``side`` and ``up``: across it, per its height.
        bone, raised, reach: As of ``build_fingertip``.
    """
    end = np.clip((share - reach) / 0.12 + 1.0, 0.0, 1.0)
    size = np.sqrt(np.maximum(1.0 - end**2, 0.0)) * (1.0 - 0.15 * np.clip(share / reach, 0.0, 1.0))
    top = raised * (1.0 - 0.25 * np.clip(share / reach, 0.0, 1.0))
    return np.asarray((side / bone[0]) ** 2 + ((up - top) / bone[1]) ** 2 < size**2)


def _cut(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
    inside: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The part of a closed surface beyond a plane that contains a point, closed by a triangle fan."""
    import pyvista

    whole = pyvista.PolyData.from_regular_faces(vertices, faces)
    part = whole.clip(normal=normal, origin=point, invert=False).triangulate().clean()
    part = part.connectivity("closest", closest_point=inside).extract_surface(algorithm="dataset_surface")
    vertices = np.asarray(part.points, dtype=np.float64)
    faces = np.asarray(part.regular_faces, dtype=np.int32)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    unordered = np.sort(edges, axis=1)
    _, index, uses = np.unique(unordered, axis=0, return_index=True, return_counts=True)
    rim = edges[index[uses == 1]]
    hub = vertices[np.unique(rim)].mean(axis=0)
    lid = np.concatenate([rim[:, ::-1], np.full((len(rim), 1), len(vertices))], axis=1)
    return np.concatenate([vertices, hub[None]]), np.concatenate([faces, lid]).astype(np.int32)
