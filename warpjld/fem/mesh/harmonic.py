"""Discrete harmonic fields on the nodes of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["harmonic_field"]


def harmonic_field(mesh: HexMesh, values: NDArray[np.float64], fixed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Field (N, k) with prescribed values at fixed nodes, discretely harmonic at all others.

    Solves L f = 0 at the free nodes, where L is the graph Laplacian of the mesh's edges with weights 1 / length. L is
    an M-matrix, so values at free nodes lie between the prescribed ones.

    Args:
        mesh: Mesh with N nodes.
        values: Prescribed values; only those of fixed nodes are used, shape (N, k).
        fixed: Mask of the fixed nodes, shape (N,).
    """
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import splu

    out, free = values.copy(), ~fixed
    if free.any():
        edges, count = mesh.edges(), len(mesh.nodes)
        stiff = 1.0 / np.linalg.norm(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]], axis=1)
        rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
        links = coo_array((np.concatenate([stiff, stiff]), (rows, columns)), shape=(count, count)).tocsr()
        laplacian = (diags_array(links.sum(axis=1)) - links).tocsr()
        factor = splu(laplacian[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        out[free] = factor.solve(links[free][:, fixed] @ out[fixed])
    return out
