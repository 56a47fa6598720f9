"""Writer of text USD caches without OpenUSD: samples are streamed to the file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import IO

import numpy as np
from numpy.typing import NDArray

from warpjld.io.caches.cache import Cache

__all__ = ["UsdTextCache"]

_PIECE = 4096
"""Values that are made text at once."""


class UsdTextCache(Cache):
    """The same content as `UsdCache` as readable text; several times larger."""

    note = "Y up, metres, subdivisionScheme none, no normals; faces and points in the source's vertex order"

    _file: IO[bytes] | None = None

    def _begin(self) -> None:
        clip, surface = self.clip, self.surface
        name = re.sub(r"^[0-9]|[^A-Za-z0-9_]", "_", clip.name) or "_"
        self._extents: list[str] = []
        self._row = ", ".join(["(%.9g, %.9g, %.9g)"] * len(surface.weld))
        self._file = self._part(self.path).open("wb")
        self._say(
            f'#usda 1.0\n(\n    defaultPrim = "{name}"\n    endTimeCode = {clip.start + clip.frames - 1}\n'
            f"    framesPerSecond = {clip.rate:.17g}\n    metersPerUnit = 1\n    startTimeCode = {clip.start}\n"
            f'    timeCodesPerSecond = {clip.rate:.17g}\n    upAxis = "Y"\n)\n\ndef Mesh "{name}"\n{{\n'
            f"    float3[] extent = {_extent(self.rest)}\n"
        )
        faces = np.asarray(surface.source_faces)
        self._say("    int[] faceVertexCounts = ", *_listed(np.full(len(faces), 3), "%d"))
        self._say("    int[] faceVertexIndices = ", *_listed(faces.ravel(), "%d"))
        self._say('    uniform token orientation = "rightHanded"\n')
        self._say("    point3f[] points = ", *_listed(self.rest, "(%.9g, %.9g, %.9g)"))
        by_corner = surface.corner_uv is not None
        uv = surface.corner_uv if by_corner else surface.uv
        if uv is not None:
            kind = "faceVarying" if by_corner else "vertex"
            texture = np.asarray(uv, np.float32).reshape(-1, 2)
            *pieces, end = _listed(texture, "(%.9g, %.9g)")
            self._say("    texCoord2f[] primvars:st = ", *pieces, end.rstrip("\n"), " (\n")
            self._say(f'        interpolation = "{kind}"\n    )\n')
        self._say('    uniform token subdivisionScheme = "none"\n    point3f[] points.timeSamples = {\n')

    def _append(self, vertices: NDArray[np.float32]) -> None:
        time = self.clip.start + self.written
        self._say(f"        {time}: [{self._row % tuple(vertices.ravel().tolist())}],\n")
        self._extents.append(f"        {time}: {_extent(vertices)},\n")

    def _finish(self) -> None:
        self._say("    }\n    float3[] extent.timeSamples = {\n", *self._extents, "    }\n}\n")
        self._close()

    def _close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _say(self, *texts: str) -> None:
        assert self._file is not None
        for text in texts:
            self._file.write(text.encode("ascii"))


def _listed(values: NDArray[np.generic], form: str) -> Iterator[str]:
    """Pieces of the text of an array, one value or tuple a row."""
    yield "["
    for start in range(0, len(values), _PIECE):
        some = values[start : start + _PIECE]
        yield (", " if start else "") + ", ".join([form] * len(some)) % tuple(some.ravel().tolist())
    yield "]\n"


def _extent(vertices: NDArray[np.float32]) -> str:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return "[({:.9g}, {:.9g}, {:.9g}), ({:.9g}, {:.9g}, {:.9g})]".format(*low.tolist(), *high.tolist())
