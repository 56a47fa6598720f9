"""Motion of a rig's own joints: poses of the canonical skeleton as transforms in the file's units and axes.

A joint of the skeleton moves its flesh by a rigid motion M(t), the rotation q(t) about its rest position x to its
position p(t). A joint of the file moves with the joint of the skeleton that it corresponds to, or belongs to
(``Rig.owner``): with B its rest transform, joint to world in the file, and S the similarity that loading applied
(``Rig.placing``),

    A(t) = S⁻¹ M(t) S B,   M(t) y = q(t) (y − x) q(t)⁻¹ + p(t)

so twist bones and helpers move rigidly with their segment, and joints above all recognised ones do not move. It is the
inverse of :func:`warpjld.motion.own_joints.own_poses`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import rotate
from warpjld.listed import first_few
from warpjld.rig import Rig
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton import Poses
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.streamed_poses import blocks_of

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["SourceMotion", "source_motion"]

_BLOCK = 512  # frames of transforms held at once, so that memory does not grow with the length of the clip


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """F frames of a rig's N own joints.

    Attributes:
        tree: The joints in the file's names, units and axes.
        owner: Joint of the skeleton that each joint moves with, -1 for those that do not move, shape (N,).
        placing: Similarity from the file's units and axes to metres with Y up, shape (4, 4).
        rest: Rest positions of the skeleton's joints [m], shape (J, 3).
        poses: Poses of the skeleton.
        notes: Information for the user of the result.
    """

    tree: SourceTree
    owner: NDArray[np.int64]
    placing: NDArray[np.float64]
    rest: NDArray[np.float64]
    poses: Poses
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def rest_frames(self) -> NDArray[np.float64]:
        """Joint-to-world transforms at rest in metres with Y up, shape (N, 4, 4); scale included."""
        return np.asarray(self.placing @ self.tree.frames)

    def rotations(self, frames: slice = slice(None)) -> NDArray[np.float64]:
        """Rotation of every joint from rest, axes of the rig (Y up), quaternions x, y, z, w, shape (f, N, 4).

        Signs are those of ``poses``: aligned along the tree, not over time.
        """
        out = self.poses[frames].rotations[:, np.maximum(self.owner, 0)]
        out[:, self.owner < 0] = (0.0, 0.0, 0.0, 1.0)
        return out

    def positions(self, frames: slice = slice(None)) -> NDArray[np.float64]:
        """Positions of every joint in the rig's frame [m, Y up], shape (f, N, 3)."""
        own = np.maximum(self.owner, 0)
        at = self.rest_frames[:, :3, 3]
        out = self.poses[frames].positions[:, own] + rotate(self.rotations(frames), at - self.rest[own])
        out[:, self.owner < 0] = at[self.owner < 0]
        return out

    def moves(self, frames: slice = slice(None)) -> NDArray[np.float64]:
        """The rigid motion M of every joint from rest, in the rig's metres and axes, shape (f, N, 4, 4)."""
        turns = self.rotations(frames)
        out = np.zeros((*turns.shape[:2], 4, 4))
        out[..., :3, :3] = (
            transform.Rotation.from_quat(turns.reshape(-1, 4)).as_matrix().reshape(*turns.shape[:2], 3, 3)
        )
        rest = self.rest_frames[:, :3, 3]
        out[..., :3, 3] = self.positions(frames) - np.einsum("fnab,nb->fna", out[..., :3, :3], rest)
        out[..., 3, 3] = 1.0
        return out

    def worlds(self, frames: slice = slice(None)) -> NDArray[np.float64]:
        """Joint-to-world transforms in the file's units and axes, shape (f, N, 4, 4)."""
        return np.asarray(np.linalg.inv(self.placing) @ self.moves(frames) @ self.placing @ self.tree.frames)

    def blocks(self, frames: int = _BLOCK) -> Iterator[slice]:
        """Ranges of frames that cover the clip, to process long clips in parts with the methods above."""
        for start in range(0, len(self), frames):
            yield slice(start, min(start + frames, len(self)))


def source_motion(rig: Rig, poses: Poses) -> SourceMotion:
    """The motion of a rig's own joints, or of its skeleton's for a rig without a file.

    Raises:
        InputError: No frames, poses of another skeleton, or poses that are not finite.
    """
    count = len(rig.skeleton)
    if len(poses) < 1:
        raise InputError("poses: want at least one frame")
    one = poses[:1]
    if one.positions.shape[1:] != (count, 3) or one.rotations.shape[1:] != (count, 4):
        raise InputError(f"poses: want {count} joints, as the rig has, got {one.positions.shape[1]}")
    for first, some in blocks_of(poses):
        for name, array in (("positions", some.positions), ("rotations", some.rotations)):
            if not np.isfinite(array).all():
                frame, joint = np.argwhere(~np.isfinite(array))[0][:2]
                where = f"{rig.skeleton.names[joint]} are not finite at frame {first + frame}"
                raise InputError(f"poses: {name} of {where}")
    if rig.source is None:
        frames = np.tile(np.eye(4), (count, 1, 1))
        frames[:, :3, 3] = rig.skeleton.rest
        tree = SourceTree(rig.skeleton.names, rig.skeleton.parents.astype(np.int64), frames)
        return SourceMotion(tree, np.arange(count), np.eye(4), rig.skeleton.rest, poses)
    owner = rig.owner
    if owner.shape != (len(rig.source),):
        raise InputError(f"rig: want an owner for each of its {len(rig.source)} joints, got shape {owner.shape}")
    return SourceMotion(rig.source, owner, rig.placing, rig.skeleton.rest, poses, _notes(rig))


def _notes(rig: Rig) -> tuple[str, ...]:
    assert rig.source is not None
    names = rig.source.names
    carried = [names[j] for j in range(len(names)) if rig.owner[j] >= 0 and j not in rig.sources]
    still = [names[j] for j in np.flatnonzero(rig.owner < 0)]
    notes = []
    if carried:
        notes.append(f"joints that move rigidly with the one they belong to: {first_few(carried, 6)}")
    if still:
        notes.append(f"joints above the recognised ones, which do not move: {first_few(still, 6)}")
    return tuple(notes)
