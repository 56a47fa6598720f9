"""Volumes of parts of a surface that joints bend, as functions of the joints' swelling amplitudes.

Parts are evaluated together by kernels, in float64: one by one, calls would take longer than the arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.device import shared_on
from warpjld.covering.rows import Rows
from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.threads import in_threads, threads_for

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["BentPart", "BentParts", "Driven", "PackedRows", "Swelling"]

_FACES = 512  # faces whose volumes are summed by one thread of a kernel
_THREAD = 50_000  # smallest number of points worth a thread of its own


@dataclass(frozen=True, eq=False)
class Driven:
    """Pose inputs of F frames.

    Attributes:
        positions: Joint positions [m], shape (F, J, 3).
        turns: Halfway rotations and bones' rotations, shape (F, 2 J, 4).
        scalars: From ``scalar_inputs``, shape (F, inputs).
    """

    positions: NDArray[np.float64]
    turns: NDArray[np.float64]
    scalars: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BentPart:
    """The part of a surface that a joint deforms, n vertices.

    Attributes:
        pivot: Rest position of the joint [m], shape (3,).
        vertices: Vertices in the whole surface, shape (n,).
        faces: Triangles over the n vertices and, after them, the means of open rims, shape (T, 3).
        rims: Sparse map from the n vertices to the means of open rims.
        at_rest: Swelling field times the joint's flexion ratio at rest, relative to all other inflation, shape (n,).
        swelling: Swelling field, shape (n,).
    """

    pivot: NDArray[np.float64]
    vertices: NDArray[np.int64]
    faces: NDArray[np.int64]
    rims: sp.csr_array
    at_rest: NDArray[np.float64]
    swelling: NDArray[np.float64]

    def rest_volume(self, rest: NDArray[np.float64]) -> float:
        """Contribution of the faces to the volume at rest [m³], from the surface's rest positions [m], shape (V, 3)."""
        points = rest[self.vertices] - self.pivot
        if self.rims.shape[0]:
            points = np.concatenate([points, self.rims @ points])
        a, b, c = (points[self.faces[:, k]] for k in range(3))
        return float((a * np.cross(b, c)).sum()) / 6.0


class PackedRows:
    """Coefficients of a surface as the kernels read them."""

    def __init__(self, rows: Rows) -> None:
        import warp as wp
        from warpjld_kernels.bent_parts import PartRows

        self.rows = PartRows()
        for name in ("positions", "turns", "scales", "muscles"):
            setattr(self.rows, name, _entries(getattr(rows, name)))
        self.rows.heights, self.rows.offset = _on_cpu(rows.heights, wp.vec3d), _on_cpu(rows.offset, wp.vec3d)
        self.rows.first_muscle = rows.scales.shape[1]


class BentParts:
    """P parts of one surface, n vertices together, each in F poses of its own.

    Args:
        parts: The parts.
        poses: First pose of each part, shape (P,).
        frames: F.
    """

    def __init__(self, parts: Sequence[BentPart], poses: Sequence[int] | NDArray[np.int64], frames: int) -> None:
        import warp as wp
        from warpjld_kernels.bent_parts import Parts

        self.parts, self.frames = parts, frames
        counts, rims = (np.array([getattr(p, name).shape[0] for p in parts]) for name in ("vertices", "rims"))
        firsts, first_rims = np.cumsum(counts) - counts, np.cumsum(rims) - rims
        self.owner = np.repeat(np.arange(len(parts)), counts)
        faces, cuts, self._blocks_of = [], [0], []
        for part, first, first_rim in zip(parts, firsts.tolist(), first_rims.tolist(), strict=True):
            # vertices of all parts come first, then the rims of all
            beyond = int(counts.sum()) + first_rim - len(part.vertices)
            faces.append(np.where(part.faces < len(part.vertices), part.faces + first, part.faces + beyond))
            begin = cuts[-1]
            self._blocks_of.append(len(cuts) - 1)
            cuts += [*range(begin + _FACES, begin + len(part.faces), _FACES), begin + len(part.faces)]
        self._faces = _on_cpu(np.concatenate(faces).astype(np.int32), wp.int32)
        self._cuts = _on_cpu(np.array(cuts, dtype=np.int32), wp.int32)
        self._model = Parts()
        for name, values in (
            ("chosen", np.concatenate([part.vertices for part in parts])),
            ("owner", self.owner),
            ("first_pose", np.asarray(poses)),
        ):
            setattr(self._model, name, _on_cpu(values.astype(np.int32), wp.int32))
        self._model.pivot = _on_cpu(np.stack([part.pivot for part in parts]), wp.vec3d)
        self._model.rims = _entries(sp.csr_array(sp.block_diag([part.rims for part in parts], format="csr")))
        self._rims = int(rims.sum())

    def __len__(self) -> int:
        return len(self.parts)

    def swelling(self, rows: PackedRows, driven: Driven, more: NDArray[np.float64]) -> Swelling:
        """The parts in their poses, offsets growing by ``more`` at amplitude 1, shape (n, F)."""
        import warp as wp
        from warpjld_kernels.bent_parts import bend_parts

        shape = (len(self.owner), self.frames)
        base, offset, growth = np.empty((*shape, 3)), np.empty((*shape, 3)), np.empty(shape)
        poses = ((driven.positions, wp.vec3d), (driven.turns, wp.quatd), (driven.scalars, wp.float64))
        inputs = [rows.rows, self._model, *(_on_cpu(values, kind) for values, kind in poses)]
        inputs += [_on_cpu(base, wp.vec3d), _on_cpu(offset, wp.vec3d), _on_cpu(growth, wp.float64)]
        self._launch(bend_parts, shape[0], inputs)
        at_rest = np.concatenate([part.at_rest for part in self.parts])
        return Swelling(self, base, offset, growth, np.ascontiguousarray(more), at_rest)

    def volumes(self, own: Any, amplitudes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Volume of every part and frame [m³], shape (P, F), and its derivative by the part's amplitude."""
        import warp as wp
        from warpjld_kernels.bent_parts import sum_volumes, swell_parts

        blocks, count = len(self._cuts) - 1, len(self.owner) + self._rims
        points, drift = (wp.empty((count, self.frames), dtype=wp.vec3d, device="cpu") for _ in range(2))
        self._launch(swell_parts, count, [self._model, own, _on_cpu(amplitudes, wp.float64), points, drift])
        sums = np.empty((blocks, self.frames, 2))
        self._launch(sum_volumes, blocks, [self._cuts, self._faces, points, drift, _on_cpu(sums, wp.vec2d)], _FACES)
        volume, slope = np.moveaxis(np.add.reduceat(sums, self._blocks_of, axis=0) / 6.0, 2, 0)
        return volume, slope

    def _launch(self, kernel: Any, count: int, inputs: list[Any], each: int = 1) -> None:
        """Launch a kernel over ``count`` rows of ``each`` points, whose first argument is the row that it starts at."""
        import warp as wp

        def span(begin: int, end: int) -> None:
            wp.launch(kernel, dim=(end - begin, self.frames), inputs=[begin, *inputs], device="cpu")

        in_threads(span, count, threads_for(count * each * self.frames, _THREAD), kernel, "cpu")


@dataclass(frozen=True, eq=False)
class Swelling:
    """Parts in F frames: base + (growth + a · more) / (1 + a · at rest) · offset for their amplitudes a.

    Offsets are divided by the swelling at rest, so that the rest pose stays exact.

    Attributes:
        parts: The parts.
        base: Positions without offsets [m], shape (n, F, 3).
        offset: Offsets in the poses without growth [m], likewise.
        growth: Their growth without swelling, shape (n, F).
        more: Swelling at amplitude 1, likewise.
        at_rest: Swelling at rest at amplitude 1, shape (n,).
    """

    parts: BentParts
    base: NDArray[np.float64]
    offset: NDArray[np.float64]
    growth: NDArray[np.float64]
    more: NDArray[np.float64]
    at_rest: NDArray[np.float64]

    def and_also(self, amplitudes: NDArray[np.float64], more: NDArray[np.float64]) -> Swelling:
        """The parts swollen by amplitudes (P,), from which something else inflates them by ``more``, shape (n, F)."""
        amplitude = amplitudes[self.parts.owner]
        thinner = (1.0 + amplitude * self.at_rest)[:, None]
        growth = (self.growth + amplitude[:, None] * self.more) / thinner
        return Swelling(self.parts, self.base, self.offset, growth, more / thinner, np.zeros_like(self.at_rest))

    def volume_and_slope(self, amplitudes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Volume of every part and frame [m³], shape (P, F), and its derivative by the part's amplitude."""
        return self.parts.volumes(self._model, amplitudes)

    @cached_property
    def _model(self) -> Any:
        """This as the kernels' struct."""
        import warp as wp
        from warpjld_kernels import bent_parts as kernels

        out = kernels.Swelling()
        out.base, out.offset = (_on_cpu(one, wp.vec3d) for one in (self.base, self.offset))
        out.growth, out.more = (_on_cpu(one, wp.float64) for one in (self.growth, self.more))
        out.at_rest = _on_cpu(self.at_rest, wp.float64)
        return out


def _entries(matrix: sp.csr_array) -> Any:
    """A sparse matrix as the kernels' struct ``warpjld_kernels.bent_parts.Entries``."""
    import warp as wp
    from warpjld_kernels.bent_parts import Entries

    out = Entries()
    out.first = _on_cpu(matrix.indptr.astype(np.int32), wp.int32)
    out.column = _on_cpu(matrix.indices.astype(np.int32), wp.int32)
    out.value = _on_cpu(matrix.data, wp.float64)
    return out


def _on_cpu(values: NDArray[Any], kind: Any) -> Any:
    """An array for the kernels, which shares its memory where it is contiguous."""
    return shared_on("cpu", np.ascontiguousarray(values), kind)
