"""Frames of any number that are computed when they are looked at, a block at a time: poses, and what they come of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.kinematics import Poses

__all__ = ["BLOCK", "HeldBlock", "StreamedPoses", "blocks_of", "streamed", "streamed_rows"]

BLOCK = 1024
"""Frames that are computed at once: some megabytes for a body, and enough to make little of what each call costs."""


class _Frames(Protocol):
    def __len__(self) -> int: ...
    def __getitem__(self, frames: slice, /) -> Self: ...


_SomeFrames = TypeVar("_SomeFrames", bound=_Frames)


class HeldBlock(Generic[_SomeFrames]):
    """F frames of any kind, of which the block looked at last is held.

    Args:
        count: F.
        made: A range of the frames.
    """

    def __init__(self, count: int, made: Callable[[slice], _SomeFrames]) -> None:
        self.made = made
        self._count = count
        self._held: tuple[int, _SomeFrames] | None = None

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, frames: slice) -> _SomeFrames:
        """A block or less, counted from 0."""
        start, stop, _ = frames.indices(self._count)
        stop = max(start, stop)
        if self._held is None or not self._held[0] <= start <= stop <= self._held[0] + len(self._held[1]):
            start_of = min(start, max(self._count - 1, 0))
            self._held = start_of, self.made(slice(start_of, min(start_of + BLOCK, self._count)))
        first, held = self._held
        return held[start - first : stop - first]

    def part(self, start: int) -> Callable[[slice], _SomeFrames]:
        """The same frames, counted from another one."""

        def made(frames: slice) -> _SomeFrames:
            span = slice(start + frames.start, start + frames.stop)
            return self[span] if frames.stop - frames.start <= BLOCK else self.made(span)

        return made


class StreamedPoses(Poses):
    """Poses that are functions of the frame, of F frames.

    Slices of a block or less are plain ``Poses``, longer ones are streamed again; only one block is held. Whoever asks
    for the arrays themselves gets them whole.

    Args:
        frames: Frame numbers, shape (F,).
        posed: Poses of some of them; of each the same, whichever others are asked for.
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
    """Poses of F frames: computed at once where they are a block or less, streamed where they are more."""
    return posed(frames) if len(frames) <= BLOCK else StreamedPoses(frames, posed)


def streamed_rows(count: int, made: Callable[[slice], Poses]) -> Poses:
    """Poses of F frames of which any range can be made."""

    def posed(frames: NDArray[np.float64]) -> Poses:
        rows = frames.astype(np.int64)
        first, last = (int(rows.min()), int(rows.max())) if len(rows) else (0, -1)
        some = made(slice(first, last + 1))
        if last - first + 1 == len(rows) and (np.diff(rows) == 1).all():
            return some
        return Poses(some.positions[rows - first], some.rotations[rows - first], some.flexion[rows - first])

    return streamed(np.arange(count, dtype=np.float64), posed)


def blocks_of(poses: Poses) -> Iterator[tuple[int, Poses]]:
    """First frame and poses of blocks, one after another, that no more than one of them is held."""
    for start in range(0, len(poses), BLOCK):
        yield start, poses[start : start + BLOCK]
