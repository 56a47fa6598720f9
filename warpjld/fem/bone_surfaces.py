"""Bone surfaces read from a file, which replace the default cylinders along the segments (B §3.3 Fig. 7, R105)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.mesh.bones import Bone
from warpjld.fem.mesh.envelope import Envelope
from warpjld.io.mesh_file import read_mesh
from warpjld.rig import Rig

__all__ = ["BoneSurface", "SurfaceBone", "bones_of_segments", "read_bones"]

_NEAR = 0.5
"""Largest accepted distance of a bone's centroid from its segment, relative to the segment's length."""


@dataclass(frozen=True, eq=False)
class BoneSurface:
    """Surface of one bone.

    Attributes:
        name: Name in the file; if it is a joint's name, the bone belongs to the segment that ends at this joint.
        vertices: Rest positions in the rig's frame [m], shape (n, 3).
        faces: Triangles, shape (t, 3).
    """

    name: str
    vertices: Array
    faces: Ints32


@dataclass(frozen=True, eq=False)
class SurfaceBone(Bone):
    """Bone with the shape of a surface; its inherited shaft gives its extent along the segment."""

    surface: BoneSurface

    @cached_property
    def _envelope(self) -> Envelope:
        return Envelope(self.surface.vertices, self.surface.faces)

    def depth(self, points: Array) -> Array:
        """0 within the surface, infinite outside of it."""
        return np.where(self._envelope.ask(points).distance < 0.0, 0.0, np.inf)


def read_bones(path: Path, rig: Rig) -> tuple[BoneSurface, ...]:
    """Read the parts of a surface file, given in the units and axes of the rig's own file, as bones.

    Raises:
        InputError: The file cannot be read.
    """
    file = read_mesh(path)
    vertices = file.vertices @ rig.placing[:3, :3].T + rig.placing[:3, 3]
    out = []
    for part in file.parts:
        used, corners = np.unique(file.faces[part.faces], return_inverse=True)
        if len(used):
            out.append(BoneSurface(part.name, vertices[used], corners.reshape(-1, 3).astype(np.int32)))
    return tuple(out)


def bones_of_segments(rig: Rig, bones: Sequence[BoneSurface]) -> dict[int, BoneSurface]:
    """Assign bones to segments, by the bone's name or else to the nearest segment.

    Returns:
        Bones, keyed by the joint at the distal end of their segment.

    Raises:
        InputError: A bone is too far from every segment, or two bones belong to the same segment.
    """
    skeleton = rig.skeleton
    out: dict[int, BoneSurface] = {}
    for bone in bones:
        name = bone.name.lower()
        joint = skeleton.names.index(name) if name in skeleton.names else _nearest(rig, bone)
        if joint in out:
            raise InputError(f"bones: '{out[joint].name}' and '{bone.name}' both lie along {skeleton.names[joint]}")
        out[joint] = bone
    return out


def _nearest(rig: Rig, bone: BoneSurface) -> int:
    """Joint at the distal end of the segment that is nearest to a bone's centroid."""
    skeleton, middle = rig.skeleton, bone.vertices.mean(axis=0)
    joints = np.flatnonzero(skeleton.parents >= 0)
    start, end = skeleton.rest[skeleton.parents[joints]], skeleton.rest[joints]
    along: NDArray[np.float64] = end - start
    length = np.maximum((along**2).sum(axis=1), 1e-18)
    share = np.clip(((middle - start) * along).sum(axis=1) / length, 0.0, 1.0)
    away = np.linalg.norm(start + share[:, None] * along - middle, axis=1)
    # prefer segments whose middle is near the centroid over those with an end near it
    best = int(np.argmin(away + 0.1 * np.sqrt(length) * np.abs(share - 0.5)))
    if away[best] > _NEAR * np.sqrt(length[best]):
        raise InputError(
            f"bones: '{bone.name}' lies {1e3 * away[best]:.0f} mm from the nearest segment: want the rig's own units "
            "and axes, or a joint's name"
        )
    return int(joints[best])
