"""The stiffness of bodies and of the contact between them, as one matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.launch import on_rows, shared
from warpjld.fem.solver.block_matrix import BlockMatrix

__all__ = ["with_contact"]


def with_contact(
    stiffness: BlockMatrix, points: list[ContactPoints], blocks: list[Array], *, threads: int
) -> BlockMatrix:
    """K + Σ_a c_ai c_aj H_a in a new matrix; its pattern is K's, or wider where contact joins bodies.

    Args:
        stiffness: K.
        points: Contact points of each interface.
        blocks: H of each interface's points [N/m], shape (m, 3, 3).
        threads: Threads.
    """
    import warp as wp
    from scipy.sparse import vstack
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
    """A copy of K with room for every pair of nodes that a row of the table joins."""
    import warp as wp
    from scipy.sparse import csr_array
    from warpjld_kernels import contact_stiffness

    if int(np.diff(table.indptr).max()) == 1:  # each point is a node: the diagonal
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
