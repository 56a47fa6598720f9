"""Base class of cache writers: validation of frames, source vertex order, and atomic creation of files."""

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
    """Timing and name of a clip: ``frames`` frames from number ``start`` at ``rate`` frames per second."""

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
    """A vertex cache being written; created by `open_cache`, used in a ``with`` statement.

    Files are written under a temporary name in the same folder and renamed when all announced frames are written.

    Attributes:
        path: The requested file.
        surface: The surface.
        clip: Its timing.
        written: Number of frames written so far.
        files: The files created; empty until the ``with`` statement has ended without error.
        note: Information for users of the files; may be empty.
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
        """Check that the libraries the format needs are installed; most formats need none.

        Raises:
            MissingExtraError: One is not installed.
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
            InputError: Wrong shape, not finite, more frames than announced, or writing fails.
            WarpjldError: Called outside of the cache's ``with`` statement.
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
            # frame by frame, since reordering copies
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
        """Temporary path of a file that becomes ``place`` on success, unique to this process, with the same suffix."""
        if place not in self._parts:
            sweep(place.parent)
            self._parts[place] = part_of(place)
        return self._parts[place]

    def _discard(self) -> None:
        with contextlib.suppress(OSError, RuntimeError, ValueError):  # closing may write to a full disk
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
        """Create the files and write everything that precedes the frames."""

    @abstractmethod
    def _append(self, vertices: NDArray[np.float32]) -> None:
        """Write one frame: little-endian float32 positions in source order, shape (W, 3)."""

    @abstractmethod
    def _finish(self) -> None:
        """Write everything that follows the last frame and close the files."""

    def _published(self) -> None:  # noqa: B027 - most formats have nothing to do
        """Called when the files have their final names."""

    @abstractmethod
    def _close(self) -> None:
        """Close open files, after success or failure; may be called repeatedly."""


def _remove(parts: dict[Path, Path]) -> None:
    for part in parts.values():
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
