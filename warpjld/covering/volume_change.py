"""Volume that flexing a joint adds to the flesh or takes from it, as a function of the joint's swelling amplitude.

Flexing one joint moves everything beyond it as a rigid body about the joint, so with the joint as the origin only faces
that deform change the sum Σ a · (b × c) / 6. Positions and sums are computed by kernels, in float64.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS
from warpjld.covering.device import shared_on
from warpjld.covering.drivers import initial_ratio
from warpjld.covering.quality import closing_fans
from warpjld.covering.rows import Rows
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp

    from warpjld.covering.covering import Covering
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Bending", "BentPart", "Driven", "Swollen"]

_FACES = 512  # faces whose volumes are summed by one thread of a kernel


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

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, frames: NDArray[np.int64] | slice) -> Driven:
        return Driven(self.positions[frames], self.turns[frames], self.scalars[frames])


class Bending:
    """A closed surface, from which the part that one joint deforms can be extracted."""

    def __init__(self, covering: Covering, rows: Rows) -> None:
        self._rows, self._skeleton = rows, covering.skeleton
        self._packed = _packed(rows)
        self._rest, self._ends = covering.surface.vertices, covering.anchors.ends
        self.swellings = covering.fields.swellings
        count = len(self._rest)
        boundary, loop = closing_fans(covering.flesh.faces)
        fans = np.column_stack([boundary[:, ::-1], count + loop])  # closes each open rim with a fan around its mean
        self._faces = np.concatenate([covering.flesh.faces.astype(np.int64), fans])
        rims = int(loop.max(initial=-1)) + 1
        share = 1.0 / np.maximum(np.bincount(loop, minlength=rims), 1)[loop]
        self._rims = sp.csr_array((share, (loop, boundary[:, 0])), shape=(rims, count))
        self._pivots, self._swelling, self._scales, self._muscles = (
            matrix.tocsc() for matrix in (rows.positions, self.swellings, rows.scales, rows.muscles)
        )
        self._grown = 1.0 + rows.scales[:, : len(self._skeleton)] @ initial_ratio(self._skeleton)

    def whole(self, amplitudes: NDArray[np.float64]) -> BentPart:
        """Whole surface, for joints with these swelling amplitudes, shape (J,)."""
        at_rest = (self.swellings @ (initial_ratio(self._skeleton) * amplitudes)) / self._grown
        everything = np.arange(len(self._rest))
        return BentPart(np.zeros(3), everything, self._rest, self._faces, self._rims, at_rest, self._rows, self._packed)

    def around(self, joint: int) -> tuple[BentPart, NDArray[np.float64]] | None:
        """The part of the surface whose faces deform when a joint is flexed, and the joint's swelling field there (n,);
        None where there is none."""
        bends = self._deformed(joint)
        rims = self._rims @ bends > 0.0
        corners = np.concatenate([bends, rims])
        deformed = corners[self._faces[:, 0]] | corners[self._faces[:, 1]] | corners[self._faces[:, 2]]
        faces = self._faces[deformed]
        if not len(faces):
            return None
        used = np.zeros(len(corners), dtype=bool)
        used[faces.ravel()] = True
        means = np.flatnonzero(used[len(self._rest) :])
        if len(means):
            used[self._rims[means].indices] = True
        vertices = np.flatnonzero(used[: len(self._rest)])
        number = np.zeros(len(corners), dtype=np.int64)
        number[vertices] = np.arange(len(vertices))
        number[len(self._rest) + means] = len(vertices) + np.arange(len(means))
        swelling = _column(self._swelling, joint)[vertices]
        part = BentPart(
            self._skeleton.rest[joint],
            vertices,
            self._rest[vertices],
            number[faces],
            self._rims[means][:, vertices] if len(means) else sp.csr_array((0, len(vertices))),
            initial_ratio(self._skeleton)[joint] * swelling / self._grown[vertices],
            self._rows,
            self._packed,
        )
        return part, swelling

    def _deformed(self, joint: int) -> NDArray[np.bool_]:
        """Which vertices neither stay nor move rigidly with the bone beyond a joint when it is flexed, shape (V,)."""
        joints = len(self._skeleton)
        beyond = np.zeros(joints)
        beyond[joint] = 1.0
        for child in range(joint + 1, joints):
            if self._skeleton.parents[child] >= 0:
                beyond[child] = beyond[self._skeleton.parents[child]]
        places = beyond.copy()
        places[joint] = 0.0
        turned = self._rows.turns @ np.concatenate([places, beyond])
        moved = self._rows.positions @ places
        still = (turned == 0.0) & (moved == 0.0)
        whole = (np.abs(turned - 1.0) < 1e-9) & (np.abs(moved + _column(self._pivots, joint) - 1.0) < 1e-9)
        bends = ~(still | whole)
        for matrix, columns in (
            (self._scales, [joint]),
            (self._swelling, [joint]),
            (self._muscles, np.flatnonzero((self._ends == joint).any(axis=1))),
        ):
            for column in columns:
                bends[matrix.indices[matrix.indptr[column] : matrix.indptr[column + 1]]] = True
        return bends


def _column(matrix: sp.csc_array, column: int) -> NDArray[np.float64]:
    """One column of a sparse matrix as a dense vector."""
    entries = slice(matrix.indptr[column], matrix.indptr[column + 1])
    out = np.zeros(matrix.shape[0])
    out[matrix.indices[entries]] = matrix.data[entries]
    return out


def _packed(rows: Rows) -> Any:
    """The rows as the kernels' struct ``warpjld_kernels.bent_part.PartRows``."""
    import warp as wp
    from warpjld_kernels.bent_part import PartRows

    out = PartRows()
    for name in ("positions", "turns", "scales", "muscles"):
        setattr(out, name, _entries(getattr(rows, name)))
    out.heights, out.offset = _on_cpu(rows.heights, wp.vec3d), _on_cpu(rows.offset, wp.vec3d)
    out.first_muscle = rows.scales.shape[1]
    return out


def _entries(matrix: sp.csr_array) -> Any:
    """A sparse matrix as the kernels' struct ``warpjld_kernels.bent_part.Entries``."""
    import warp as wp
    from warpjld_kernels.bent_part import Entries

    out = Entries()
    out.first = _on_cpu(matrix.indptr.astype(np.int32), wp.int32)
    out.column = _on_cpu(matrix.indices.astype(np.int32), wp.int32)
    out.value = _on_cpu(matrix.data, wp.float64)
    return out


def _on_cpu(values: NDArray[Any], kind: Any) -> Any:
    """An array for the kernels, which shares its memory where it is contiguous."""
    return shared_on("cpu", np.ascontiguousarray(values), kind)


@dataclass(frozen=True, eq=False)
class BentPart:
    """The part of a surface that a joint deforms, n vertices.

    Attributes:
        pivot: Rest position of the joint [m], shape (3,).
        vertices: Its vertices in the whole surface, shape (n,).
        rest: Their rest positions [m], shape (n, 3).
        faces: Triangles over the vertices and the means of open rims, shape (T, 3).
        rims: Sparse map from the n vertices to the means of open rims.
        at_rest: Swelling field times the joint's flexion ratio at rest, relative to all other inflation, shape (n,).
        rows: Coefficients of the whole surface, and ``packed`` the same for kernels.
    """

    pivot: NDArray[np.float64]
    vertices: NDArray[np.int64]
    rest: NDArray[np.float64]
    faces: NDArray[np.int64]
    rims: sp.csr_array
    at_rest: NDArray[np.float64]
    rows: Rows
    packed: Any

    def rest_volume(self) -> float:
        """Contribution of the part's faces to the enclosed volume at rest [m³]."""
        points = self.rest - self.pivot
        a, b, c = (np.concatenate([points, self.rims @ points])[self.faces[:, k]] for k in range(3))
        return float((a * np.cross(b, c)).sum()) / 6.0

    def swollen(self, driven: Driven, swelling: NDArray[np.float64]) -> Swollen:
        """The part in poses, its vertices swelling by ``swelling`` at amplitude 1, shape (n, F)."""
        import warp as wp
        from warpjld_kernels.bent_part import bend_part

        shape = (len(self.vertices), len(driven))
        base, offset, growth = np.empty((*shape, 3)), np.empty((*shape, 3)), np.empty(shape)
        poses = ((driven.positions, wp.vec3d), (driven.turns, wp.quatd), (driven.scalars, wp.float64))
        chosen = _on_cpu(self.vertices.astype(np.int32), wp.int32)
        inputs = [self.packed, chosen, wp.vec3d(*self.pivot.tolist()), *(_on_cpu(a, kind) for a, kind in poses)]
        outputs = [_on_cpu(base, wp.vec3d), _on_cpu(offset, wp.vec3d), _on_cpu(growth, wp.float64)]
        wp.launch(bend_part, dim=shape, inputs=inputs, outputs=outputs, device="cpu")
        return Swollen(self, base, offset, growth, np.ascontiguousarray(swelling))

    def thickened(self, driven: Driven, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """What palm pairs' thickening adds to the growth of the part's offsets in poses, shape (n, F)."""
        columns = len(driven.positions[0]) + (STATIONS * pairs[:, None] + np.arange(STATIONS)).ravel()
        return np.asarray(self.rows.scales[self.vertices][:, columns] @ driven.scalars[:, columns].T)


@dataclass(frozen=True, eq=False)
class Swollen:
    """A part in F frames: base + (growth + a · more) / (1 + a · at rest) · offset for the amplitude a.

    Offsets are divided by the swelling at rest, so that the rest pose stays exact.

    Attributes:
        part: The part.
        base: Positions without offsets [m], shape (n, F, 3).
        offset: Offsets in the poses without growth [m], likewise.
        growth: Their growth without swelling, shape (n, F).
        more: Swelling at amplitude 1, likewise.
    """

    part: BentPart
    base: NDArray[np.float64]
    offset: NDArray[np.float64]
    growth: NDArray[np.float64]
    more: NDArray[np.float64]

    def and_also(self, amplitude: float, more: NDArray[np.float64]) -> Swollen:
        """The part swollen by an amplitude, from which something else inflates it by ``more``, shape (n, F)."""
        thinner = (1.0 + amplitude * self.part.at_rest)[:, None]
        part = replace(self.part, at_rest=np.zeros_like(self.part.at_rest))
        growth = (self.growth + amplitude * self.more) / thinner
        return Swollen(part, self.base, self.offset, growth, more / thinner)

    def volume(self, amplitude: float) -> NDArray[np.float64]:
        """Volume of every frame [m³], shape (F,)."""
        return self.volume_and_slope(amplitude)[0]

    def volume_and_slope(self, amplitude: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Volume of every frame [m³] and its derivative by the amplitude, shape (F,) each."""
        swell, sum_up, sums = self._launches
        swell.set_param_at_index(1, amplitude)
        swell.launch()
        sum_up.launch()
        volume, slope = sums.sum(axis=0).T / 6.0
        return volume, slope

    @cached_property
    def _launches(self) -> tuple[Any, Any, NDArray[np.float64]]:
        """Launches of the kernels that evaluate it, prepared once, and the sums over faces that they leave."""
        import warp as wp
        from warpjld_kernels import bent_part as kernels

        part = kernels.BentPart()
        part.base, part.offset = (_on_cpu(one, wp.vec3d) for one in (self.base, self.offset))
        part.growth, part.more = (_on_cpu(one, wp.float64) for one in (self.growth, self.more))
        part.at_rest, part.rims = _on_cpu(self.part.at_rest, wp.float64), _entries(self.part.rims)
        frames, faces = self.growth.shape[1], _on_cpu(self.part.faces.astype(np.int32), wp.int32)
        shape, blocks = (sum(self.part.rims.shape), frames), -(-len(faces) // _FACES)
        points, drift = (wp.empty(shape, dtype=wp.vec3d, device="cpu") for _ in range(2))
        sums = np.empty((blocks, frames, 2))
        places = {"device": "cpu", "record_cmd": True}
        swell = wp.launch(kernels.swell_part, shape, [part, 0.0], [points, drift], **places)
        inputs, outputs = [faces, points, drift, _FACES], [_on_cpu(sums, wp.vec2d)]
        return swell, wp.launch(kernels.sum_volume, (blocks, frames), inputs, outputs, **places), sums
