"""Sequences of frames, such as poses, that are computed on demand, one block at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.kinematics import Poses

__all__ = ["BLOCK", "HeldBlock", "StreamedPoses", "blocks_of", "streamed", "streamed_rows"]

BLOCK = 1024
"""Frames per block: some megabytes for a body, and enough to make the overhead of a call negligible."""


class _Frames(Protocol):
    def __len__(self) -> int: ...
    def __getitem__(self, frames: slice, /) -> Self: ...


_SomeFrames = TypeVar("_SomeFrames", bound=_Frames)


class HeldBlock(Generic[_SomeFrames]):
    """F frames, computed in blocks, of which the last one is cached.

    Args:
        count: Count F of frames.
        made: Function that computes a range of frames.
    """

    def __init__(self, count: int, made: Callable[[slice], _SomeFrames]) -> None:
        self.made = made
        self._count = count
        self._held: tuple[int, _SomeFrames] | None = None

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frames: slice) -> _SomeFrames:
        """A range of at most one block of frames, counted from 0."""
        start, stop, _ = frames.indices(self._count)
        stop = max(start, stop)
        if self._held is None or not self._held[0] <= start <= stop <= self._held[0] + len(self._held[1]):
            start_of = min(start, max(self._count - 1, 0))
            self._held = start_of, self.made(slice(start_of, min(start_of + BLOCK, self._count)))
        first, held = self._held
        return held[start - first : stop - first]

    def part(self, start: int) -> Callable[[slice], _SomeFrames]:
        """Function that computes a range of these frames, counted from frame ``start``."""

        def made(frames: slice) -> _SomeFrames:
            span = slice(start + frames.start, start + frames.stop)
            return self[span] if frames.stop - frames.start <= BLOCK else self.made(span)

        return made


class StreamedPoses(Poses):
    """Poses of F frames, computed on demand by a function of the frame numbers.

    Slices of at most one block are plain ``Poses``, longer ones are streamed; one block is cached. The array attributes
    compute and keep all frames.

    Args:
        frames: Frame numbers, shape (F,).
        posed: Function that computes the poses at some frames; a pose must not depend on the other frames given.
    """

    _frames: NDArray[np.float64]
    _posed: Callable[[NDArray[np.float64]], Poses]
    _held: tuple[int, Poses]

    def __init__(self, frames: NDArray[np.float64], posed: Callable[[NDArray[np.float64]], Poses]) -> None:
        self.__dict__ |= {"_frames": frames, "_posed": posed, "_held": (0, posed(frames[:1])[:0])}

    def __len__(self) -> int:
        return len(self._frames)

    def __repr__(self) -> str:
        return f"StreamedPoses({len(self)} frames of {self._held[1].positions.shape[1]} joints)"

    def __getitem__(self, frames: slice) -> Poses:
        start, stop, step = frames.indices(len(self))
        if step != 1 or stop - start > BLOCK:
            return StreamedPoses(self._frames[frames], self._posed)
        first, held = self._held
        if not first <= start <= stop <= first + len(held):
            first, held = start, self._posed(self._frames[start : start + BLOCK])
            self.__dict__["_held"] = first, held
        return held[start - first : max(stop, start) - first]

    @cached_property
    def _whole(self) -> Poses:
        return self._posed(self._frames)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Joint positions [m], shape (F, J, 3)."""
        return self._whole.positions

    @property
    def rotations(self) -> NDArray[np.float64]:
        """Rotations of the bones from rest, shape (F, J, 4)."""
        return self._whole.rotations

    @property
    def flexion(self) -> NDArray[np.float64]:
        """Vertical flexions [rad], shape (F, J)."""
        return self._whole.flexion


def streamed(frames: NDArray[np.float64], posed: Callable[[NDArray[np.float64]], Poses]) -> Poses:
    """Poses of F frames: computed at once if they fit in one block, otherwise streamed."""
    return posed(frames) if len(frames) <= BLOCK else StreamedPoses(frames, posed)


def streamed_rows(count: int, made: Callable[[slice], Poses]) -> Poses:
    """Poses of F frames, from a function that computes any range of them."""

    def posed(frames: NDArray[np.float64]) -> Poses:
        rows = frames.astype(np.int64)
        first, last = (int(rows.min()), int(rows.max())) if len(rows) else (0, -1)
        some = made(slice(first, last + 1))
        if last - first + 1 == len(rows) and (np.diff(rows) == 1).all():
            return some
        return Poses(some.positions[rows - first], some.rotations[rows - first], some.flexion[rows - first])

    return streamed(np.arange(count, dtype=np.float64), posed)


def blocks_of(poses: Poses) -> Iterator[tuple[int, Poses]]:
    """Consecutive blocks of poses, each with the index of its first frame, so that only one is in memory."""
    for start in range(0, len(poses), BLOCK):
        yield start, poses[start : start + BLOCK]
