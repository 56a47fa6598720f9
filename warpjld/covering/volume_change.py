"""Volume that flexing a joint adds to the flesh or takes from it, as a function of the joint's swelling amplitude.

Flexing one joint moves everything beyond it as a rigid body about the joint, so with the joint as the origin only faces
that deform change the sum Σ a · (b × c) / 6. All frames are evaluated at once, component by component.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS
from warpjld.covering.drivers import initial_ratio
from warpjld.covering.quality import closing_fans
from warpjld.covering.rows import Rows
from warpjld.geometry.rotations import rotate
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp

    from warpjld.covering.covering import Covering
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Bending", "BentPart", "Driven", "Swollen"]


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
        entries = np.arange(rows.muscles.nnz)
        self._entries = sp.csr_array((entries, rows.muscles.indices, rows.muscles.indptr), shape=rows.muscles.shape)

    def whole(self, amplitudes: NDArray[np.float64]) -> BentPart:
        """Whole surface, for joints with these swelling amplitudes, shape (J,)."""
        at_rest = (self.swellings @ (initial_ratio(self._skeleton) * amplitudes)) / self._grown
        return BentPart(np.zeros(3), self._rest, self._faces, self._rims, at_rest, self._rows)

    def around(self, joint: int) -> tuple[BentPart, NDArray[np.float64]] | None:
        """The part of the surface whose faces deform when a joint is flexed, and the joint's swelling field there (n,);
        None where there is none."""
        bends = self._deformed(joint)
        rims = self._rims @ bends > 0.0
        corners = np.concatenate([bends, rims])
        faces = self._faces[corners[self._faces].any(axis=1)]
        if not len(faces):
            return None
        used = np.unique(faces)
        means = used[used >= len(self._rest)] - len(self._rest)
        vertices = used[: len(used) - len(means)]
        if len(means):
            vertices = np.union1d(vertices, self._rims[means].indices)
        number = np.zeros(len(corners), dtype=np.int64)
        number[vertices] = np.arange(len(vertices))
        number[len(self._rest) + means] = len(vertices) + np.arange(len(means))
        rows = self._rows
        swelling = _column(self._swelling, joint)[vertices]
        part = BentPart(
            self._skeleton.rest[joint],
            self._rest[vertices],
            number[faces],
            self._rims[means][:, vertices],
            initial_ratio(self._skeleton)[joint] * swelling / self._grown[vertices],
            Rows(
                rows.positions[vertices],
                rows.turns[vertices],
                rows.scales[vertices],
                rows.muscles[vertices],
                rows.heights[self._entries[vertices].data],
                rows.offset[vertices],
            ),
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


@dataclass(frozen=True, eq=False)
class BentPart:
    """The part of a surface that a joint deforms, n vertices.

    Attributes:
        pivot: Rest position of the joint [m], shape (3,).
        rest: Rest positions [m], shape (n, 3).
        faces: Triangles over the vertices and the means of open rims, shape (T, 3).
        rims: Sparse map from the n vertices to the means of open rims.
        at_rest: Swelling field times the joint's flexion ratio at rest, relative to all other inflation, shape (n,).
        rows: Coefficients of the n vertices.
    """

    pivot: NDArray[np.float64]
    rest: NDArray[np.float64]
    faces: NDArray[np.int64]
    rims: sp.csr_array
    at_rest: NDArray[np.float64]
    rows: Rows

    def rest_volume(self) -> float:
        """Contribution of the part's faces to the enclosed volume at rest [m³]."""
        points = np.ascontiguousarray((self.rest - self.pivot).T)[:, :, None]
        return float(_volume(*self._corners(points))[0])

    def swollen(self, driven: Driven, swelling: NDArray[np.float64]) -> Swollen:
        """The part in poses, its vertices swelling by ``swelling`` at amplitude 1, shape (n, F)."""
        rows, frames = self.rows, len(driven)
        turn = (rows.turns @ driven.turns.transpose(1, 0, 2).reshape(-1, 4 * frames)).reshape(-1, frames, 4)
        ratios = rows.scales.shape[1]
        grown = 1.0 + rows.scales @ driven.scalars[:, :ratios].T
        out = rotate(turn, rows.offset[:, None])
        raised = np.stack([self._raised(k) @ driven.scalars[:, ratios:].T for k in range(3)], axis=2)
        places = driven.positions.transpose(1, 0, 2).reshape(-1, 3 * frames)
        base = (rows.positions @ places).reshape(-1, frames, 3) - self.pivot + rotate(turn, raised)
        base, own, more = (
            np.ascontiguousarray(np.moveaxis(points, 2, 0))
            for points in (base, grown[:, :, None] * out, swelling[:, :, None] * out)
        )
        return Swollen(self, base, own, more)

    def thickened(self, driven: Driven, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """What palm pairs' thickening adds to the part in poses [m], shape (3, n, F)."""
        columns = len(driven.positions[0]) + (STATIONS * pairs[:, None] + np.arange(STATIONS)).ravel()
        return self.swollen(driven, self.rows.scales[:, columns] @ driven.scalars[:, columns].T).more

    def _raised(self, axis: int) -> sp.csr_array:
        """Map from the muscles' drives to one coordinate of the heights that they raise [m], shape (n, S)."""
        muscles = self.rows.muscles
        return sp.csr_array((muscles.data * self.rows.heights[:, axis], muscles.indices, muscles.indptr), muscles.shape)

    def _corners(self, points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Corners of all faces, three arrays of shape (3, T, F); from vertices, shape (3, n, F)."""
        if self.rims.shape[0]:
            points = np.concatenate([points, np.stack([self.rims @ one for one in points])], axis=1)
        return [points[:, self.faces[:, k]] for k in range(3)]


@dataclass(frozen=True, eq=False)
class Swollen:
    """A part in F frames: base + (own + a · more) / (1 + a · at rest) for the amplitude a.

    Offsets are divided by the swelling at rest, so that the rest pose stays exact.

    Attributes:
        part: The part.
        base: Positions without offsets [m], shape (3, n, F).
        own: Offsets inflated without swelling [m], likewise.
        more: Swelling at amplitude 1 [m], likewise.
    """

    part: BentPart
    base: NDArray[np.float64]
    own: NDArray[np.float64]
    more: NDArray[np.float64]

    def and_also(self, amplitude: float, more: NDArray[np.float64]) -> Swollen:
        """The part swollen by an amplitude, from which something else inflates it by ``more`` [m], shape (3, n, F)."""
        thinner = (1.0 + amplitude * self.part.at_rest)[:, None]
        part = replace(self.part, at_rest=np.zeros_like(self.part.at_rest))
        return Swollen(part, self.base, (self.own + amplitude * self.more) / thinner, more / thinner)

    def of(self, frames: NDArray[np.bool_]) -> Swollen:
        """Only some of the frames."""
        return Swollen(self.part, self.base[..., frames], self.own[..., frames], self.more[..., frames])

    def volume(self, amplitude: float) -> NDArray[np.float64]:
        """Volume of every frame [m³], shape (F,)."""
        return _volume(*self.part._corners(self._points(amplitude)))

    def volume_and_slope(self, amplitude: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Volume of every frame [m³] and its derivative by the amplitude, shape (F,) each."""
        thinner = (1.0 + amplitude * self.part.at_rest)[:, None]
        a, b, c = self.part._corners(self._points(amplitude))
        drift = (self.more - self.own * self.part.at_rest[:, None]) / thinner**2
        da, db, dc = self.part._corners(drift)
        normal = _cross(b, c)
        turning = _cross(db, c) + _cross(b, dc)
        return _sum(a, normal) / 6.0, (_sum(da, normal) + _sum(a, turning)) / 6.0

    def _points(self, amplitude: float) -> NDArray[np.float64]:
        thinner = (1.0 + amplitude * self.part.at_rest)[:, None]
        return self.base + (self.own + amplitude * self.more) / thinner


def _volume(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Σ a · (b × c) / 6 of every frame, shape (F,); corners of shape (3, T, F)."""
    return _sum(a, _cross(b, c)) / 6.0


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross products of vectors whose components are stored one after the other, shape (3, …)."""
    out = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]
    return out


def _sum(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of the scalar products of every frame, shape (F,)."""
    return np.asarray(np.einsum("ctf,ctf->f", a, b))
