"""Tangent of contact: the symmetric part, added to the bodies' stiffness, and the non-symmetric part E.

E contains the derivatives of weights and normals. With pressures of the order of the flesh's modulus they matter:
finger pads roll and slide on each other, facets then press on other nodes, and Newton's method oscillates without them.
The derivatives are exact: those of the weights by forward-mode automatic differentiation of the integrals, one facet
pair at a time (Puso & Laursen 2004 give them in closed form).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron, vstack

from warpjld.fem.arrays import Array, Ints, Ints32, cross_matrix
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.mortar import Mortar
from warpjld.fem.contact.interface.surface import ContactSurface
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.law.return_mapping import ContactTractions
from warpjld.fem.launch import on_rows, shared

__all__ = [
    "FacetPairs",
    "MortarTangent",
    "block_table",
    "friction_coupling",
    "inner_rows",
    "linearise_mortar",
    "normal_derivatives",
    "with_contact",
]


def with_contact(
    stiffness: BlockMatrix, points: list[ContactPoints], blocks: list[Array], *, threads: int
) -> BlockMatrix:
    """K + Σ_a c_ai c_aj H_a as a new matrix; its sparsity pattern is extended where contact couples bodies.

    Args:
        stiffness: K.
        points: Contact points of each interface.
        blocks: H of each interface's points [N/m], shape (m, 3, 3).
        threads: Number of threads.
    """
    import warp as wp
    from warpjld_kernels import contact_stiffness

    tables, rows_of = [], []
    for point, block in zip(points, blocks, strict=True):
        used = np.flatnonzero(block.any(axis=(1, 2)))
        if len(used):
            tables.append(point.weights[used])
            rows_of.append(block[used])
    if not tables:
        return stiffness
    table = vstack(tables, format="csr") if len(tables) > 1 else tables[0]
    rows, columns, values = _widened(stiffness, table, threads)
    transposed = table.T.tocsr()
    nodes = np.flatnonzero(np.diff(transposed.indptr)).astype(np.int32)
    kept = [
        np.ascontiguousarray(a)
        for a in (
            *(part for m in (table, transposed) for part in (_int(m.indptr), _int(m.indices), m.data)),
            np.concatenate(rows_of),
        )
    ]
    arguments: list[Any] = [shared(a) for a in (nodes, *kept[:6])]
    arguments += [wp.array(kept[6], dtype=wp.mat33d, device="cpu", copy=False)]
    arguments += [shared(rows), shared(columns), wp.array(values, dtype=wp.mat33d, device="cpu", copy=False)]
    on_rows(contact_stiffness.add_rows, len(nodes), arguments, threads=threads, least=100)
    return BlockMatrix(rows, columns, values)


def _widened(stiffness: BlockMatrix, table: Any, threads: int) -> tuple[Ints32, Ints32, Array]:
    """A copy of K (rows, columns, values) with its pattern extended by all pairs of nodes in a row of the table."""
    import warp as wp
    from warpjld_kernels import contact_stiffness

    if int(np.diff(table.indptr).max()) == 1:  # points are single nodes: only diagonal blocks change
        return stiffness.rows, stiffness.columns, stiffness.values.copy()
    n = stiffness.size
    touched = csr_array((np.ones(len(table.indices), np.int32), table.indices, table.indptr), shape=table.shape)
    joined = touched.T @ touched
    pattern = csr_array((np.ones(len(stiffness.columns), np.int32), stiffness.columns, stiffness.rows), shape=(n, n))
    wide = csr_array(pattern + joined)
    wide.sort_indices()
    rows, columns = _int(wide.indptr), _int(wide.indices)
    if len(columns) == len(stiffness.columns):
        return stiffness.rows, stiffness.columns, stiffness.values.copy()
    values = np.empty((len(columns), 3, 3))
    arguments = [
        shared(stiffness.rows),
        shared(stiffness.columns),
        wp.array(stiffness.values, dtype=wp.mat33d, device="cpu", copy=False),
        shared(rows),
        shared(columns),
        wp.array(values, dtype=wp.mat33d, device="cpu", copy=False),
    ]
    on_rows(contact_stiffness.copy_rows, n, arguments, threads=threads)
    return rows, columns, values


def _int(values: NDArray[Any]) -> Ints32:
    return np.ascontiguousarray(values, dtype=np.int32)


_NEAR, _DEEP = 0.5, 0.05
"""Gap below which derivatives are computed, as it may close in an iteration, and penetration above which derivatives of
the gaps are omitted, as its facets will separate; both in element edges."""


@dataclass(frozen=True, eq=False)
class MortarTangent:
    """Derivatives of m points with respect to the displacement (3N,) due to changing weights and normals.

    Attributes:
        gap: Derivatives of the gaps of active points, ``csr_array`` (m, 3N).
        forces: Negative derivatives of the nodal forces, to be added to the stiffness [N/m], ``csr_array`` (3N, 3N).
    """

    gap: Any
    forces: Any


def linearise_mortar(
    mortar: Mortar,
    points: ContactPoints,
    tractions: ContactTractions,
    state: ContactState,
    penalty: Array,
    x: Array,
    reach: float,
) -> MortarTangent | None:
    """Derivatives at positions x (N, 3) at which the points and normals were found; None without active points.

    The tractions that turn with the normals are the multipliers, without the penalty term, since overlaps of an initial
    guess are not pressures. Derivatives of friction with respect to the normal and to the point at which slip is
    measured are omitted.

    Args:
        mortar: The surfaces.
        points: Contact points.
        tractions: Their tractions.
        state: Contact states with the multipliers.
        penalty: ε [Pa/m], shape (m,).
        x: Positions of the nodes [m], shape (N, 3).
        reach: Search distance [m].
    """
    if not tractions.active.any():
        return None
    edge = mortar.slave.edge[points.sites]
    rows = np.flatnonzero(tractions.active | (points.gap < _NEAR * edge))
    pairs = FacetPairs(mortar, points, rows, x, reach)
    turning = normal_derivatives(mortar.slave, x, points.sites, rows)
    pressure = np.where(tractions.active, np.maximum(state.pressure[points.sites], 0.0), 0.0)
    carried = np.where(tractions.active[:, None], state.friction[points.sites], 0.0)
    of_weights = pairs.forces(carried - pressure[:, None] * points.normal)
    change = -diags_array(np.repeat(pressure, 3)) @ turning
    of_gap = csr_array((len(edge), x.size))
    if not (tractions.error > _DEEP * edge).any():
        apart = np.zeros_like(points.normal)
        apart[pairs.rows] = (points.weights @ x)[pairs.rows]
        of_gap = csr_array(pairs.gaps() - inner_rows(apart) @ turning)
        stiff = np.where(tractions.active, penalty, 0.0)
        change = change + inner_rows(points.normal).T @ (diags_array(stiff) @ of_gap)
    spreading = block_table(points.weights.T @ diags_array(points.area))
    return MortarTangent(of_gap, csr_array(-(spreading @ change + of_weights)))


def friction_coupling(points: ContactPoints, tractions: ContactTractions, friction: float, penalty: Array) -> Any:
    """Negative derivatives of the friction of sliding points with respect to their pressure, to be added to the
    stiffness [N/m], ``csr_array`` (3N, 3N); None if no point slides.

    They matter most where all points slide: an object about to slip out of a hand moves far for a small force, and an
    alternating iteration over pressure and friction converges slowly.

    Args:
        points: Contact points, with their ``gap_derivative`` if known.
        tractions: Their tractions, friction bounded by the pressures.
        friction: Coulomb's μ.
        penalty: ε [Pa/m], shape (m,).
    """
    size = np.linalg.norm(tractions.friction, axis=1)
    slides = tractions.active & ~tractions.sticking & (size > 0.0)
    if not slides.any():
        return None
    along = np.where(slides[:, None], tractions.friction / np.maximum(size, 1e-300)[:, None], 0.0)
    weights = block_table(points.weights)
    of_gap = -inner_rows(points.normal) @ weights
    if points.gap_derivative is not None:
        of_gap = of_gap + points.gap_derivative
    rubs = weights.T @ inner_rows(points.area[:, None] * along).T
    return csr_array(rubs @ (diags_array(friction * penalty) @ of_gap))


class FacetPairs:
    """Facet pairs of some contact points, with the derivatives of their mortar integrals.

    Attributes:
        rows: Indices of the points, among m.
        corner: Point at each corner of the slave facets, -1 for none of these, shape (P, 4).
        column: Degrees of freedom of the corners, slave's first, shape (P, 24).
        own: Derivatives of ∫ N_a N_b with respect to them, shape (P, 24, 4, 4).
        far: Derivatives of ∫ N_a M_b, likewise.
    """

    def __init__(self, mortar: Mortar, points: ContactPoints, rows: Ints, x: Array, reach: float) -> None:
        assert points.facets is not None
        assert points.share is not None
        slave = mortar.slave
        number = np.full(len(slave.nodes), -1)
        number[points.sites[rows]] = rows
        chosen = (number[slave.corners[points.facets[:, 0]]] >= 0).any(axis=1)
        facets, share = points.facets[chosen], points.share[chosen]
        nodes = np.concatenate([slave.quads[facets[:, 0]], mortar.master.quads[facets[:, 1]]], axis=1)
        self.rows = rows
        self.corner = number[slave.corners[facets[:, 0]]]
        self.column = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 24)
        self._mortar, self._points, self._at, self._size = mortar, points, x[nodes], x.size
        change = mortar.derivatives(facets, x, reach)
        change *= share[:, None, None]
        self.own, self.far = (change[:, :, k : k + 16].reshape(-1, 24, 4, 4) for k in (0, 16))

    def gaps(self) -> Any:
        """Derivatives of the gaps through the weights, ``csr_array`` (m, 3N)."""
        points, corner, at = self._points, self.corner, self._at
        spread = np.matmul(self.own, at[:, None, :4]) - np.matmul(self.far, at[:, None, 4:])
        off, per_area = self._mortar.sliver_offset(points.sites, points.area)
        wider = self.own.sum(axis=3)
        mean = np.einsum("pkai,pai->pka", spread, points.normal[corner]) + (points.gap - off)[corner][:, None] * wider
        if self._mortar.offset is not None:
            share, by_area = self._mortar.sliver_share(points.sites, points.area)
            offset = self._mortar.offset[self.column[:, ::3] // 3]
            outside = np.einsum("pkab,pb->pka", self.own, offset[:, :4])
            outside += np.einsum("pkab,pb->pka", self.far, offset[:, 4:])
            mean += share[corner][:, None] * outside
            per_area = per_area - by_area * (abs(points.weights) @ self._mortar.offset)
        gap = per_area[corner][:, None] * wider - mean / points.area[corner][:, None]
        where = np.broadcast_to(corner[:, None] >= 0, gap.shape)
        row = np.broadcast_to(corner[:, None], gap.shape)[where]
        column = np.broadcast_to(self.column[:, :, None], gap.shape)[where]
        return csr_array(coo_array((gap[where], (row, column)), shape=(len(points.sites), self._size)))

    def forces(self, traction: Array) -> Any:
        """Derivatives of the nodal forces of tractions (m, 3) through the weights [N/m], ``csr_array`` (3N, 3N)."""
        known = np.where(self.corner[:, :, None] >= 0, traction[self.corner], 0.0)
        loaded = known.any(axis=(1, 2))
        known, column = known[loaded], self.column[loaded]
        # axes: facet pair, degree of freedom that moves, node that is loaded
        pushed = [np.matmul(part[loaded].transpose(0, 1, 3, 2), known[:, None]) for part in (self.own, -self.far)]
        block = np.concatenate(pushed, axis=2).reshape(-1, 24, 24)
        row = np.broadcast_to(column[:, None, :], block.shape)
        column = np.broadcast_to(column[:, :, None], block.shape)
        shape = (self._size, self._size)
        return csr_array(coo_array((block.ravel(), (row.ravel(), column.ravel())), shape=shape))


def normal_derivatives(surface: ContactSurface, x: Array, sites: Ints, rows: Ints) -> Any:
    """Derivatives of the nodal normals, ``csr_array`` (3m, 3N), zero except at ``rows``."""
    number = np.full(len(surface.nodes), -1)
    number[sites[rows]] = rows
    faces = np.flatnonzero((number[surface.corners] >= 0).any(axis=1))
    quads, corner = surface.quads[faces], number[surface.corners[faces]]
    length = np.linalg.norm(surface.at_nodes(surface.area_vectors(x)), axis=1)[surface.corners[faces]]
    length = np.where(length > 0.0, length, 1.0)
    a, b, c, d = (x[quads[:, k]] for k in range(4))
    # derivatives of (c − a) × (d − b) / 8: each corner gets a quarter of the face's area vector
    along, across = cross_matrix(c - a), cross_matrix(d - b)
    each = 0.125 * np.stack([across, -along, -across, along], axis=1)  # face, node, 3, 3
    n = surface.normals(x)[surface.corners[faces]]
    plane = np.eye(3) - n[:, :, :, None] * n[:, :, None, :]
    block = np.einsum("faij,fbjk->fabik", plane, each) / length[:, :, None, None, None]
    known = np.broadcast_to((corner >= 0)[:, :, None, None, None], block.shape)
    row = np.broadcast_to((3 * corner[:, :, None] + np.arange(3))[:, :, None, :, None], block.shape)
    column = np.broadcast_to((3 * quads[:, :, None] + np.arange(3))[:, None, :, None, :], block.shape)
    shape = (3 * len(sites), x.size)
    return csr_array(coo_array((block[known], (row[known], column[known])), shape=shape))


def inner_rows(vectors: Array) -> Any:
    """Block-diagonal matrix (m, 3m) of inner products with each point's vector (m, 3)."""
    count = len(vectors)
    return csr_array((vectors.ravel(), np.arange(3 * count), 3 * np.arange(count + 1)), shape=(count, 3 * count))


def block_table(weights: Any) -> Any:
    """A sparse matrix of scalars (n, m) expanded to 3 × 3 diagonal blocks, (3n, 3m)."""
    return csr_array(kron(weights, eye_array(3), format="csr"))
