"""What all cache writers share: checking the frames, source vertex order, and all or nothing on disk."""

from __future__ import annotations

import contextlib
import math
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, WarpjldError
from warpjld.files.whole_file import part_of, sweep
from warpjld.geometry.surface import Surface

__all__ = ["Cache", "CacheTiming"]


@dataclass(frozen=True)
class CacheTiming:
    """Timing and name of what is cached: ``frames`` frames from ``start`` on at ``rate`` frames per second."""

    frames: int
    rate: float
    start: int = 0
    name: str = "surface"

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise InputError(f"frames: want 1 or more, got {self.frames}")
        if not (math.isfinite(self.rate) and self.rate > 0):
            raise InputError(f"rate: want frames per second above 0, got {self.rate}")


class Cache(ABC):
    """A vertex cache being written; made by `open_cache`, used in a ``with`` statement.

    Files are written under a temporary name beside their place and renamed when all announced frames are there.

    Attributes:
        path: The file asked for.
        surface: The surface that moves.
        clip: Its timing.
        written: Frames written so far.
        files: The files made: empty until the ``with`` statement has ended well.
        note: What whoever opens the files should know; may be empty.
    """

    note: str = ""

    def __init__(self, path: Path, surface: Surface, clip: CacheTiming) -> None:
        self.path = path
        self.written = 0
        self.files: tuple[Path, ...] = ()
        self.surface = surface
        self.clip = clip
        self._parts: dict[Path, Path] = {}
        self._open = False
        self._forget = weakref.finalize(self, _remove, self._parts)

    @classmethod
    def check(cls) -> None:
        """Make sure that what the format needs is installed; most need nothing.

        Raises:
            MissingExtraError: It is not.
        """
        return

    @property
    def rest(self) -> NDArray[np.float32]:
        """Rest positions in source order [m], shape (W, 3)."""
        return self.surface.to_source(self.surface.vertices.astype(np.float32))

    def write(self, vertices: NDArray[np.float32]) -> None:
        """Append frames.

        Args:
            vertices: Welded positions [m], shape (n, V, 3).

        Raises:
            InputError: Wrong shape, not finite, more frames than announced, or the disk refuses.
            WarpjldError: Outside of the cache's ``with`` statement.
        """
        if not self._open:
            raise WarpjldError("a cache is written inside its with statement: with open_cache(...) as cache: ...")
        block = np.asarray(vertices)
        want = len(self.surface.vertices)
        if block.ndim != 3 or block.shape[1:] != (want, 3):
            raise InputError(f"vertices: want shape (n, {want}, 3), got {block.shape}", path=self.path)
        if self.written + len(block) > self.clip.frames:
            raise InputError(
                f"{self.written + len(block)} frames written, {self.clip.frames} were announced", path=self.path
            )
        if not np.isfinite(block).all():
            frame, vertex = np.argwhere(~np.isfinite(block))[0][:2]
            number = self.clip.start + self.written + int(frame)
            raise InputError(f"vertices: vertex {vertex} of frame {number} is not finite", path=self.path)
        with self._disk():
            # one frame at a time: the source's order is a copy, and blocks may be long
            for frame_vertices in block:
                self._append(np.ascontiguousarray(self.surface.to_source(frame_vertices), dtype="<f4"))
                self.written += 1

    def __enter__(self) -> Self:
        with self._disk():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            try:
                self._begin()
            except BaseException:
                self._discard()
                raise
        self._open = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open = False
        try:
            if kind is None and self.written != self.clip.frames:
                raise InputError(f"{self.written} of {self.clip.frames} frames were written", path=self.path)
            if kind is None:
                with self._disk():
                    self._finish()
                    for place, part in self._parts.items():
                        part.replace(place)
                    self._published()
                self.files = tuple(self._parts)
        finally:
            self._discard()

    def _part(self, place: Path) -> Path:
        """Temporary place of a file that becomes ``place`` on success: of this process alone, with the same suffix."""
        if place not in self._parts:
            sweep(place.parent)
            self._parts[place] = part_of(place)
        return self._parts[place]

    def _discard(self) -> None:
        with contextlib.suppress(OSError, RuntimeError, ValueError):  # closing writes, and the disk may be full
            self._close()
        _remove(self._parts)
        self._parts.clear()

    @contextlib.contextmanager
    def _disk(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputError(f"cannot write: {error.strerror or error}", path=error.filename or self.path) from error

    @abstractmethod
    def _begin(self) -> None:
        """Create the files and write what does not depend on the frames."""

    @abstractmethod
    def _append(self, vertices: NDArray[np.float32]) -> None:
        """Write one frame: little-endian float32 positions in source order, shape (W, 3)."""

    @abstractmethod
    def _finish(self) -> None:
        """Write what follows the last frame and close the files."""

    def _published(self) -> None:  # noqa: B027 - most formats have nothing to do
        """The files are at their places."""

    @abstractmethod
    def _close(self) -> None:
        """Let go of open files, after success or failure; may be called again."""


def _remove(parts: dict[Path, Path]) -> None:
    for part in parts.values():
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
