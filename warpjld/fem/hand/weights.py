"""Smooth weights of the bones at all nodes of a hand's mesh, for blended motions of the flesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["bone_weights"]


def bone_weights(mesh: HexMesh, bones: Sequence[NDArray[np.int32]]) -> NDArray[np.float64]:
    """Harmonic weights: one at a bone's own nodes, falling smoothly to zero at those of others, shape (N, bones).

    Solves L w = 0 between the bones, L the graph Laplacian of the mesh's edges with weights 1 / length: an M-matrix, so
    weights lie in 0…1 and rows sum to one. Distances are through flesh, not through the air between fingers.

    Args:
        mesh: Mesh at rest.
        bones: Nodes of each bone.
    """
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import splu

    count = len(mesh.nodes)
    edges = mesh.edges()
    stiff = 1.0 / np.linalg.norm(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]], axis=1)
    rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
    links = coo_array((np.concatenate([stiff, stiff]), (rows, columns)), shape=(count, count)).tocsr()
    out = np.zeros((count, len(bones)))
    for column, nodes in enumerate(bones):
        out[nodes, column] = 1.0
    free = out.sum(axis=1) == 0.0
    if free.any():
        laplacian = (diags_array(links.sum(axis=1)) - links).tocsr()
        factor = splu(laplacian[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        out[free] = factor.solve(links[free][:, ~free] @ out[~free])
    out = np.clip(out, 0.0, 1.0)
    weights: NDArray[np.float64] = out / out.sum(axis=1, keepdims=True)
    return weights
