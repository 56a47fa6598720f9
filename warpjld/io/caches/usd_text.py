"""Writer of text USD caches, which streams samples into OpenUSD's text instead of holding all of them in memory."""

from __future__ import annotations

import shutil
import tempfile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.io.caches.cache import Cache
from warpjld.io.caches.usd import UsdCache, build_stage, extent_of

__all__ = ["UsdTextCache"]

# placeholder of the samples in the text exported from the stage
_MARK = "0: [(0.125, 0.25, 0.5)],"


class UsdTextCache(Cache):
    """The same content as `UsdCache` as readable text; several times larger."""

    note = UsdCache.note

    _stage: Any = None
    _samples: IO[bytes] | None = None

    @classmethod
    def check(cls) -> None:
        """Check that OpenUSD is installed.

        Raises:
            MissingExtraError: It is not installed.
        """
        UsdCache.check()

    def _begin(self) -> None:
        self._stage, self._mesh = build_stage(self, None)
        self._mesh.GetPointsAttr().Set([(0.125, 0.25, 0.5)], 0)
        self._row = ", ".join(["(%.9g, %.9g, %.9g)"] * len(self.surface.weld))
        self._part(self.path).touch()
        self._samples = tempfile.TemporaryFile(dir=self.path.parent)  # noqa: SIM115 - closed in _close

    def _append(self, vertices: NDArray[np.float32]) -> None:
        assert self._samples is not None
        time = self.clip.start + self.written
        self._mesh.GetExtentAttr().Set(extent_of(vertices), time)
        self._samples.write(f"        {time}: [{self._row % tuple(vertices.ravel().tolist())}],\n".encode())

    def _finish(self) -> None:
        assert self._samples is not None
        head, _, tail = self._stage.GetRootLayer().ExportToString().partition(f"{_MARK}\n")
        if not tail:
            raise RuntimeError("OpenUSD's text form is not as expected: write .usdc instead")
        self._samples.seek(0)
        with self._part(self.path).open("wb") as file:
            file.write(head.rstrip(" ").encode())
            shutil.copyfileobj(self._samples, file, 1 << 20)
            file.write(tail.encode())
        self._close()

    def _close(self) -> None:
        samples, self._samples, self._stage, self._mesh = self._samples, None, None, None
        if samples is not None:
            samples.close()
