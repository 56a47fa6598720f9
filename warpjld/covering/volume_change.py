"""Parts of a surface that single joints bend.

Flexing one joint moves everything beyond it as a rigid body about the joint, so with the joint as the origin only faces
that deform change the volume Σ a · (b × c) / 6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.bent_parts import BentPart
from warpjld.covering.drivers import initial_ratio
from warpjld.covering.quality import closing_fans
from warpjld.covering.rows import Rows
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp

    from warpjld.covering.covering import Covering
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Bending"]


class Bending:
    """A closed surface, from which the part that one joint deforms can be extracted.

    Attributes:
        rest: Rest positions [m], shape (V, 3).
        swellings: Swelling fields, shape (V, J).
    """

    def __init__(self, covering: Covering, rows: Rows) -> None:
        self._rows, self._skeleton = rows, covering.skeleton
        self.rest, self._ends = covering.surface.vertices, covering.anchors.ends
        self.swellings = covering.fields.swellings
        count = len(self.rest)
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
        everything = np.arange(len(self.rest))
        return BentPart(np.zeros(3), everything, self._faces, self._rims, at_rest, self.swellings @ amplitudes)

    def around(self, joint: int) -> BentPart | None:
        """The part of the surface whose faces deform when a joint is flexed; None where there is none."""
        bends = self._deformed(joint)
        rims = self._rims @ bends > 0.0
        corners = np.concatenate([bends, rims])
        deformed = corners[self._faces[:, 0]] | corners[self._faces[:, 1]] | corners[self._faces[:, 2]]
        faces = self._faces[deformed]
        if not len(faces):
            return None
        used = np.zeros(len(corners), dtype=bool)
        used[faces.ravel()] = True
        means = np.flatnonzero(used[len(self.rest) :])
        if len(means):
            used[self._rims[means].indices] = True
        vertices = np.flatnonzero(used[: len(self.rest)])
        number = np.zeros(len(corners), dtype=np.int64)
        number[vertices] = np.arange(len(vertices))
        number[len(self.rest) + means] = len(vertices) + np.arange(len(means))
        swelling = _column(self._swelling, joint)[vertices]
        return BentPart(
            self._skeleton.rest[joint],
            vertices,
            number[faces],
            self._rims[means][:, vertices] if len(means) else sp.csr_array((0, len(vertices))),
            initial_ratio(self._skeleton)[joint] * swelling / self._grown[vertices],
            swelling,
        )

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
