"""Film files: pictures are appended one by one, and encoded as they come."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, MissingExtraError, WarpjldError
from warpjld.files.whole_file import part_of

__all__ = ["Film"]

_SLOWEST, _SLOWEST_GIF, _FASTEST = 0.01, 0.002, 1000.0
"""Frame rates [1/s]: the lowest for ffmpeg (two decimals), for GIF (655 s per picture at most), and the highest."""
_PILLOW = {".gif": "GIF", ".webp": "WEBP"}
_FFMPEG = {".mp4": "mp4", ".mov": "mov", ".mkv": "matroska"}


class Film:
    """A film being written; use it in a ``with`` statement.

    ``.mp4``, ``.mov`` and ``.mkv`` (H.264) need the extra ``film`` and are encoded as frames come; ``.gif`` and
    ``.webp`` need no extra, but keep their frames in memory until the end. The file appears when it is complete: after
    an exception none is left.

    >>> with Film("hand.mp4", rate=25) as film, Scene(faces, camera) as scene:   # doctest: +SKIP
    ...     for vertices in frames:
    ...         film.append(scene.draw(vertices))

    Args:
        path: Where to write; its folder is made if missing.
        rate: Frames per second.

    Attributes:
        frames: Pictures appended so far.

    Raises:
        InputError: Unknown suffix, a rate out of range, or (on entering) a file that cannot be written.
        MissingExtraError: On entering, if the encoder is not installed.
    """

    def __init__(self, path: str | Path, *, rate: float = 25.0) -> None:
        self.path = Path(path)
        self.rate = float(rate)
        self.frames = 0
        known = [*_FFMPEG, *_PILLOW]
        if self.path.suffix.lower() not in known:
            raise InputError(f"unknown kind of film '{self.path.suffix}': want one of {', '.join(known)}", path=path)
        slowest, fastest = (_SLOWEST if self.path.suffix.lower() in _FFMPEG else _SLOWEST_GIF), _FASTEST
        if not slowest <= self.rate <= fastest:
            raise InputError(f"rate: want {slowest:g} to {fastest:g} frames per second, got {self.rate:g}", path=path)
        self._part = part_of(self.path)
        self._shape: tuple[int, ...] | None = None
        self._encoder: Any = None
        self._open = False

    def append(self, picture: NDArray[np.uint8]) -> None:
        """Add a frame, uint8 (height, width, 3), of the first one's size.

        Raises:
            InputError: Another size or type, or the file cannot be written.
            WarpjldError: Outside of the film's ``with`` statement.
        """
        if not self._open:
            raise WarpjldError("a film is written inside its with statement: with Film(...) as film: ...")
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
            raise InputError(f"picture: want uint8 (height, width, 3), got {picture.dtype} {picture.shape}")
        if self._shape not in (None, picture.shape):
            raise InputError(f"picture: want the size of the first, {self._shape}, got {picture.shape}")
        self._shape = picture.shape
        with self._disk():
            self._encoder.add(picture)
        self.frames += 1

    def __enter__(self) -> Self:
        suffix = self.path.suffix.lower()
        with self._disk():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._part.touch()  # fails now where the file cannot be written, not after an hour of drawing
        try:
            if suffix in _FFMPEG:
                self._encoder = _Ffmpeg(self._part, self.rate, _FFMPEG[suffix])
            else:
                self._encoder = _Pillow(self._part, self.rate, _PILLOW[suffix])
        except BaseException:
            self._part.unlink(missing_ok=True)
            raise
        self._open = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open = False
        try:
            if kind is None and self.frames == 0:
                raise InputError("film: want at least one picture, got none", path=self.path)
            with self._disk():
                self._encoder.close(kind is None)
                if kind is None:
                    self._part.replace(self.path)
        finally:
            with suppress(OSError):
                self._part.unlink(missing_ok=True)

    @contextmanager
    def _disk(self) -> Iterator[None]:
        """Report errors of the operating system as InputErrors that name the file."""
        try:
            yield
        except OSError as error:
            raise InputError(f"cannot write: {error.strerror or error}", path=self.path) from error


class _Ffmpeg:
    """H.264 encoder: the ffmpeg program of imageio-ffmpeg, run as a subprocess, since only its exit code and its
    messages show whether a film is complete."""

    def __init__(self, path: Path, rate: float, container: str) -> None:
        try:
            from imageio_ffmpeg import get_ffmpeg_exe
        except ImportError as error:
            raise MissingExtraError("writing video", "film") from error
        try:
            self._program = get_ffmpeg_exe()
        except RuntimeError as error:
            raise InputError(f"the ffmpeg program was not found: {error}", path=path) from error
        self._path, self._rate, self._container = path, rate, container
        self._running: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None

    def add(self, picture: NDArray[np.uint8]) -> None:
        # with yuv420p both sides must be even
        even = np.pad(picture, ((0, picture.shape[0] % 2), (0, picture.shape[1] % 2), (0, 0)), mode="edge")
        if self._running is None:
            self._output = tempfile.TemporaryFile()  # noqa: SIM115 - not a pipe, which would fill up unread
            command = self._command(even.shape[1], even.shape[0])
            self._running = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=self._output, stderr=self._output)
        assert self._running.stdin is not None
        try:
            self._running.stdin.write(np.ascontiguousarray(even).data)
        except BrokenPipeError:
            self._running.wait()
            raise OSError(self._reason()) from None

    def close(self, complete: bool) -> None:
        running, self._running = self._running, None
        if running is None:
            return
        assert running.stdin is not None
        try:
            if not complete:
                running.kill()
            with suppress(BrokenPipeError):
                running.stdin.close()
            code = running.wait()
            if complete and (code or not self._path.stat().st_size):
                raise OSError(self._reason() or f"ffmpeg ends with code {code}")
        finally:
            if self._output is not None:
                self._output.close()

    def _command(self, width: int, height: int) -> list[str]:
        # visually lossless, playable while loading, with explicit colour space, which players else guess by size
        return [
            self._program,
            *("-y", "-v", "error", "-f", "rawvideo", "-vcodec", "rawvideo", "-pix_fmt", "rgb24"),
            *("-s", f"{width}x{height}", "-r", f"{self._rate:.6f}", "-i", "-", "-an"),
            *("-vcodec", "libx264", "-pix_fmt", "yuv420p"),
            *("-crf", "16", "-preset", "veryfast", "-movflags", "+faststart"),
            *("-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd"),
            *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
            *("-f", self._container, str(self._path.absolute())),
        ]

    def _reason(self) -> str:
        """Last line of ffmpeg's output."""
        if self._output is None:
            return ""
        self._output.seek(0)
        lines = self._output.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else "ffmpeg ended before the film did"


class _Pillow:
    """Animated GIF or WebP."""

    def __init__(self, path: Path, rate: float, kind: str) -> None:
        self._path, self._kind, self._rate = path, kind, rate
        self._pictures: list[Any] = []

    def add(self, picture: NDArray[np.uint8]) -> None:
        from PIL import Image

        image = Image.fromarray(picture.copy())
        self._pictures.append(image.quantize(256, dither=Image.Dither.NONE) if self._kind == "GIF" else image)

    def close(self, complete: bool) -> None:
        if complete:
            first, *rest = self._pictures
            options: dict[str, Any] = {"quality": 88, "method": 2} if self._kind == "WEBP" else {"disposal": 1}
            first.save(
                self._path,
                format=self._kind,
                save_all=True,
                append_images=rest,
                duration=[self._duration(k) for k in range(len(self._pictures))],
                loop=0,
                **options,
            )
        self._pictures.clear()

    def _duration(self, frame: int) -> int:
        """Duration of a frame [ms], rounded (GIF has hundredths of a second) so that the film's length is right."""
        unit = 10 if self._kind == "GIF" else 1
        ends = [round(1000 / unit * k / self._rate) for k in (frame, frame + 1)]
        return max(unit * (ends[1] - ends[0]), unit)
