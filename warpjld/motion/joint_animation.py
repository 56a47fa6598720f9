"""Animation of a joint tree by world transforms of every joint and frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.files.spilled_rows import SpilledRows
from warpjld.geometry.rotations import upright
from warpjld.geometry.scales import polar
from warpjld.motion.clip import Clip, streamed_clip
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.streamed_poses import BLOCK, HeldBlock

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["JointAnimation", "StreamedAnimation", "spilled_animation", "streamed_animation"]


@dataclass(frozen=True, eq=False)
class JointAnimation:
    """F frames of a joint tree, in its file's names, order, units and axes.

    Attributes:
        tree: The joints and their rest; of a file that also holds a rig, the same joints in the same order as that
            rig's ``source``.
        worlds: Joint-to-world transforms, shape (F, N, 4, 4). Zero scale is replaced by a tiny one, and axes are not
            mirrored where they were not at rest (see ``warpjld.geometry.scales``), so that every frame has a rotation.
        rate: Frames a second.
        title: The animation's name; "" where the file gives none.
        notes: Information for the user of the result.
        warnings: What of the file is ignored.
        up: The file's up axis, ``y`` or ``z``; None if it does not state one.
    """

    tree: SourceTree
    worlds: NDArray[np.float64]
    rate: float
    title: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    up: str | None = None

    def __len__(self) -> int:
        return len(self.worlds)

    def __getitem__(self, frames: slice) -> JointAnimation:
        return replace(self, worlds=self.worlds[frames])

    def plain(self) -> JointAnimation:
        """Plain animation with all frames in memory."""
        return self

    def blocks(self) -> Iterator[tuple[int, JointAnimation]]:
        """Consecutive blocks, each with the number of its first frame, so that only one needs to be in memory."""
        for start in range(0, len(self), BLOCK):
            yield start, self[start : start + BLOCK]

    def clip(self) -> Clip:
        """The animation as positions and rotations from rest, parents first, for retargeting.

        Rotated to Y up if the file states Z up.
        """
        order = np.array(sorted(range(len(self.tree)), key=lambda j: (self.tree.depth(j), j)))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        above = self.tree.parents[order]
        parents = np.where(above >= 0, place[above], -1)
        names = tuple(self.tree.names[j] for j in order)
        turn = np.eye(4)
        turn[:3, :3] = upright(self.up)
        rest = turn @ self.tree.frames[order]
        back = np.linalg.inv(rest[:, :3, :3])

        def some(frames: slice) -> Clip:
            worlds = turn @ self[frames].worlds[:, order]
            turned, _ = polar(worlds[..., :3, :3] @ back)
            turns = transform.Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat()
            return Clip(
                names,
                parents,
                rest=rest[:, :3, 3],
                positions=worlds[..., :3, 3],
                rotations=turns.reshape(*worlds.shape[:2], 4),
                rate=self.rate,
            )

        return streamed_clip(len(self), some)


class StreamedAnimation(JointAnimation):
    """Animation whose frames are computed on demand, one block at a time, as in ``StreamedClip``.

    Args:
        head: Animation of any of its frames, which supplies everything but the frames.
        count: Number of frames.
        made: Function that computes a range of frames.
    """

    _blocks: HeldBlock[JointAnimation]

    def __init__(self, head: JointAnimation, count: int, made: Callable[[slice], JointAnimation]) -> None:
        stated = {name: getattr(head, name) for name in ("tree", "rate", "title", "notes", "warnings", "up")}
        self.__dict__ |= stated | {"_blocks": HeldBlock(count, made)}

    def __len__(self) -> int:
        return len(self._blocks)

    def __getitem__(self, frames: slice) -> JointAnimation:
        start, stop, _ = frames.indices(len(self))
        if stop - start > BLOCK:
            return StreamedAnimation(self, stop - start, self._blocks.part(start))
        return self._blocks[start:stop]

    def plain(self) -> JointAnimation:
        """Plain animation with all its frames in memory."""
        return self._whole

    @cached_property
    def _whole(self) -> JointAnimation:
        return self._blocks.made(slice(0, len(self)))

    @property
    def worlds(self) -> NDArray[np.float64]:
        """Joint-to-world transforms, shape (F, N, 4, 4)."""
        return self._whole.worlds


def streamed_animation(count: int, made: Callable[[slice], JointAnimation]) -> JointAnimation:
    """Animation of F frames: plain if they fit in one block, otherwise streamed."""
    return made(slice(0, count)) if count <= BLOCK else StreamedAnimation(made(slice(0, 1)), count, made)


def spilled_animation(head: JointAnimation, rows: SpilledRows) -> JointAnimation:
    """Animation from transforms that were read block by block, each frame a row of N × 16 numbers.

    Args:
        head: Animation that supplies everything but the frames.
        rows: Transforms of the frames.
    """
    shape = (-1, len(head.tree), 4, 4)
    return streamed_animation(len(rows), lambda frames: replace(head, worlds=rows[frames].reshape(shape)))
