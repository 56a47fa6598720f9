"""A recorded motion of any skeleton, before retargeting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import conjugate, multiply, rotate, slerp
from warpjld.limits import check_limit
from warpjld.motion.frame_times import frame_times
from warpjld.skeleton.streamed_poses import BLOCK, HeldBlock

__all__ = ["Clip", "StreamedClip", "streamed_clip"]


@dataclass(frozen=True, eq=False)
class Clip:
    """F frames of a skeleton of B joints, in its file's names, units and axes.

    Attributes:
        names: The file's joint names, parents first.
        parents: Parent of every joint, -1 for a root, shape (B,).
        rest: Joint positions at rest, shape (B, 3).
        positions: Joint positions, shape (F, B, 3).
        rotations: Rotation of every bone from rest, world axes, unit quaternions x, y, z, w, shape (F, B, 4).
        rate: Frames a second.
        notes: Information for the user of the result.
        warnings: What is ignored in the file, or looks wrong.
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    rest: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rate: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, frames: slice) -> Clip:
        return replace(self, positions=self.positions[frames], rotations=self.rotations[frames])

    def stating(self, *, rate: float | None = None, notes: tuple[str, ...], warnings: tuple[str, ...] = ()) -> Clip:
        """Copy with other notes and warnings, and with another frame rate if one is given."""
        return replace(self, rate=self.rate if rate is None else rate, notes=notes, warnings=warnings)

    def plain(self) -> Clip:
        """Plain clip with all frames in memory."""
        return self

    def blocks(self) -> Iterator[Clip]:
        """Consecutive blocks of frames, so that only one needs to be in memory."""
        for start in range(0, len(self), BLOCK):
            yield self[start : start + BLOCK]

    def each(self, found: Callable[[Clip], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Apply a function to each block of frames and concatenate the results."""
        return np.concatenate([found(block) for block in self.blocks()])

    def mapped(self, changed: Callable[[Clip], Clip]) -> Clip:
        """Clip with every frame mapped by a function that depends on that frame only."""
        return streamed_clip(len(self), lambda frames: changed(self[frames].plain()))

    def at_rate(self, rate: float) -> Clip:
        """The same motion at another rate: rotations interpolated spherically, positions linearly."""
        if rate == self.rate or len(self) < 2:
            return self.stating(rate=rate, notes=self.notes, warnings=self.warnings)
        times = np.arange(len(self)) / self.rate
        wanted = frame_times(0.0, times[-1], rate)
        check_limit("transforms", len(wanted) * len(self.names))

        def resampled(frames: slice) -> Clip:
            at = wanted[frames]
            first = max(int(np.searchsorted(times, at[0], side="right")) - 1, 0)
            span = slice(min(first, len(times) - 2), max(int(np.searchsorted(times, at[-1], side="right")) + 1, 2))
            some, when = self[span].plain(), times[span]
            flat = some.positions.reshape(len(some), -1)
            positions = np.stack([np.interp(at, when, column) for column in flat.T], axis=-1)
            positions = positions.reshape(len(at), *some.positions.shape[1:])
            return replace(some, positions=positions, rotations=slerp(when, some.rotations, at), rate=rate)

        return streamed_clip(len(wanted), resampled)

    def locals(self) -> NDArray[np.float64]:
        """Rotations of all bones relative to their parents', shape (F, B, 4)."""
        inner = self.parents >= 0
        out = self.rotations.copy()
        out[:, inner] = multiply(conjugate(self.rotations[:, self.parents[inner]]), self.rotations[:, inner])
        return out

    def rebased(self, frame: int, turns: NDArray[np.float64]) -> Clip:
        """The same motion with another rest pose: that of a frame, with every bone rotated back.

        With p and R the positions and rotations of joints, f the frame and H_j the rotation of bone j, the new rest's
        bones and the rotations from it are

            d'_j = H_j⁻¹ (p_child(f) − p_j(f)),   R'_j(t) = R_j(t) R_j(f)⁻¹ H_j

        Args:
            frame: Number of the frame.
            turns: H, unit quaternions, shape (B, 4).
        """
        there = self[frame : frame + 1]
        places = there.positions[0]
        rest = np.empty_like(self.rest)
        for j, parent in enumerate(self.parents):
            if parent < 0:
                rest[j] = rotate(conjugate(turns[j]), places[j])
            else:
                rest[j] = rest[parent] + rotate(conjugate(turns[parent]), places[j] - places[parent])
        back = multiply(conjugate(there.rotations[0]), turns)
        return self.mapped(lambda some: replace(some, rest=rest, rotations=multiply(some.rotations, back)))

    def turned_rest(self, turn: NDArray[np.float64]) -> Clip:
        """The same motion with its rest pose rotated as a whole by a quaternion."""
        rest, back = rotate(turn, self.rest), conjugate(turn)
        return self.mapped(lambda some: replace(some, rest=rest, rotations=multiply(some.rotations, back)))


class StreamedClip(Clip):
    """Clip whose frames are computed on demand, one block at a time.

    Slices of at most one block are plain clips, longer ones are streamed clips. Whoever asks for the arrays themselves
    gets them whole.

    Args:
        head: Clip of any of its frames, which supplies everything but the frames.
        count: Number of frames.
        made: Function that computes a range of frames; a frame must not depend on the range.
    """

    _blocks: HeldBlock[Clip]

    def __init__(self, head: Clip, count: int, made: Callable[[slice], Clip]) -> None:
        stated = {name: getattr(head, name) for name in ("names", "parents", "rest", "rate", "notes", "warnings")}
        self.__dict__ |= stated | {"_blocks": HeldBlock(count, made)}

    def __len__(self) -> int:
        return len(self._blocks)

    def __getitem__(self, frames: slice) -> Clip:
        start, stop, _ = frames.indices(len(self))
        if stop - start > BLOCK:
            return StreamedClip(self, stop - start, self._blocks.part(start))
        return self._like(self._blocks[start:stop])

    def stating(self, *, rate: float | None = None, notes: tuple[str, ...], warnings: tuple[str, ...] = ()) -> Clip:
        """See :class:`Clip`."""
        head = self[:1].stating(rate=rate, notes=notes, warnings=warnings)
        return StreamedClip(head, len(self), self._blocks.part(0))

    def plain(self) -> Clip:
        """All frames as arrays."""
        return self._whole

    @cached_property
    def _whole(self) -> Clip:
        return self._like(self._blocks.made(slice(0, len(self))))

    def _like(self, some: Clip) -> Clip:
        return Clip(
            self.names, self.parents, self.rest, some.positions, some.rotations, self.rate, self.notes, self.warnings
        )

    @property
    def positions(self) -> NDArray[np.float64]:
        """Joint positions, shape (F, B, 3)."""
        return self._whole.positions

    @property
    def rotations(self) -> NDArray[np.float64]:
        """Rotation of every bone from rest, shape (F, B, 4)."""
        return self._whole.rotations


def streamed_clip(count: int, made: Callable[[slice], Clip]) -> Clip:
    """Clip of F frames: plain if they fit in one block, otherwise streamed."""
    return made(slice(0, count)) if count <= BLOCK else StreamedClip(made(slice(0, 1)), count, made)
