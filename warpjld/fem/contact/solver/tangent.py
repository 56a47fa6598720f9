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
from scipy.sparse import csr_array, diags_array, eye_array, kron, vstack

from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.mortar import Mortar
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.law.return_mapping import ContactTractions
from warpjld.fem.contact.solver.facet_pairs import FacetPairs
from warpjld.fem.launch import on_rows, shared

__all__ = [
    "MortarTangent",
    "block_table",
    "friction_coupling",
    "inner_rows",
    "linearise_mortar",
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
    pressure = np.where(tractions.active, np.maximum(state.pressure[points.sites], 0.0), 0.0)
    carried = np.where(tractions.active[:, None], state.friction[points.sites], 0.0)
    of_weights = pairs.forces(carried - pressure[:, None] * points.normal)
    change = -diags_array(np.repeat(pressure, 3)) @ pairs.normals(pressure > 0.0)
    of_gap = csr_array((len(edge), x.size))
    if not (tractions.error > _DEEP * edge).any():
        apart = np.zeros_like(points.normal)
        apart[pairs.rows] = (points.weights @ x)[pairs.rows]
        of_gap = pairs.gaps(apart)
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


def inner_rows(vectors: Array) -> Any:
    """Block-diagonal matrix (m, 3m) of inner products with each point's vector (m, 3)."""
    count = len(vectors)
    return csr_array((vectors.ravel(), np.arange(3 * count), 3 * np.arange(count + 1)), shape=(count, 3 * count))


def block_table(weights: Any) -> Any:
    """A sparse matrix of scalars (n, m) expanded to 3 × 3 diagonal blocks, (3n, 3m)."""
    return csr_array(kron(weights, eye_array(3), format="csr"))
