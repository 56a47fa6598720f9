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
        """The same frames as arrays."""
        return self

    def blocks(self) -> Iterator[tuple[int, JointAnimation]]:
        """First frame and frames of blocks, one after another, of which no more than one need be held."""
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
    """An animation whose frames are computed when they are looked at, a block at a time, as of ``StreamedClip``.

    Args:
        head: Any of its frames: what is not an array of frames.
        count: Number of frames.
        made: A range of its frames.
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
        """All frames as arrays."""
        return self._whole

    @cached_property
    def _whole(self) -> JointAnimation:
        return self._blocks.made(slice(0, len(self)))

    @property
    def worlds(self) -> NDArray[np.float64]:
        """Joint-to-world transforms, shape (F, N, 4, 4)."""
        return self._whole.worlds


def streamed_animation(count: int, made: Callable[[slice], JointAnimation]) -> JointAnimation:
    """An animation of F frames: made at once where they are a block or less, streamed where they are more."""
    return made(slice(0, count)) if count <= BLOCK else StreamedAnimation(made(slice(0, 1)), count, made)


def spilled_animation(head: JointAnimation, rows: SpilledRows) -> JointAnimation:
    """An animation whose transforms were read one block after another, each frame a row of N × 16 numbers.

    Args:
        head: What is not an array of frames.
        rows: The frames.
    """
    shape = (-1, len(head.tree), 4, 4)
    return streamed_animation(len(rows), lambda frames: replace(head, worlds=rows[frames].reshape(shape)))
