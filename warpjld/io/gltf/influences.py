"""Joints and weights of a skinned primitive from all JOINTS_n and WEIGHTS_n, validated and completed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.coincident import close_pairs
from warpjld.io.gltf.document import Document
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
    import scipy.sparse.csgraph as csgraph
    import scipy.spatial as spatial
else:
    sp = lazy_module("scipy.sparse")
    csgraph = lazy_module("scipy.sparse.csgraph")
    spatial = lazy_module("scipy.spatial")

__all__ = ["read_gltf_influences"]

_MOST_SETS = 64  # largest number of sets of four influences


def read_gltf_influences(
    document: Document,
    attributes: dict[str, Any],
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    joints: int,
    name: str,
    notes: list[str],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Influencing joints and weights, shape (V, K): unused slots have joint 0 and weight 0, rows sum to one.

    A vertex without weights gets those of the nearest one along the surface that has some.

    Args:
        document: The file.
        attributes: The primitive's attributes by name.
        points: Its vertices, shape (V, 3).
        faces: Its triangles, shape (T, 3).
        joints: Number of the skin's joints.
        name: Name of the mesh, for messages.
        notes: Notes on repairs are appended.

    Raises:
        InputError: No weights, wrong shapes, negative or non-finite values, or joints that do not exist.
    """
    index, weight = _all_sets(document, attributes, len(points), name)
    if not np.isfinite(weight).all() or (weight < 0).any():
        bad = int(np.argwhere(~(np.isfinite(weight) & (weight >= 0)))[0][0])
        raise InputError(f"mesh '{name}': vertex {bad} has a negative or non-finite weight", path=document.path)
    used = np.where(weight > 0, index, 0)
    if used.size and used.max() >= joints:
        bad = int(np.argwhere(used >= joints)[0][0])
        raise InputError(
            f"mesh '{name}': vertex {bad} follows joint {used[bad].max()}, the skin has {joints}", path=document.path
        )
    bare = weight.sum(axis=1) <= 0.0
    if bare.any():
        if bare.all():
            raise InputError(f"mesh '{name}': no vertex has any weight", path=document.path)
        source = _nearest_weighted(points, faces, bare)
        used[bare], weight[bare] = used[source], weight[source]
        few = ", ".join(str(v) for v in np.flatnonzero(bare)[:4]) + (", …" if bare.sum() > 4 else "")
        notes.append(f"mesh '{name}': {int(bare.sum())} vertices without any weight ({few}) follow their neighbours")
    total = weight.sum(axis=1)
    off = np.abs(total - 1) > 0.01
    if off.any():
        notes.append(f"mesh '{name}': weights of {int(off.sum())} vertices did not sum to one, normalised")
    return used, weight / total[:, None]


def _all_sets(
    document: Document, attributes: dict[str, Any], vertices: int, name: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    indices, weights = [], []
    for n in range(_MOST_SETS):
        if attributes.get(f"JOINTS_{n}") is None or attributes.get(f"WEIGHTS_{n}") is None:
            break
        indices.append(document.accessor(attributes[f"JOINTS_{n}"]).astype(np.int64))
        weights.append(document.accessor(attributes[f"WEIGHTS_{n}"]).astype(np.float64))
    if not indices:
        raise InputError(f"mesh '{name}' uses a skin but has no JOINTS_0 and WEIGHTS_0", path=document.path)
    index, weight = np.concatenate(indices, axis=1), np.concatenate(weights, axis=1)
    if index.shape != weight.shape or len(index) != vertices:
        raise InputError(f"mesh '{name}': joints and weights do not match its {vertices} vertices", path=document.path)
    return index, weight


def _nearest_weighted(
    points: NDArray[np.float64], faces: NDArray[np.int64], bare: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """For every unweighted vertex the nearest weighted one along edges; in space if no edges lead to one."""
    weighted = np.flatnonzero(~bare)
    wanted = np.flatnonzero(bare)
    # coincident vertices at seams are joined by edges of tiny length (scipy treats zero as no edge)
    size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    seams = close_pairs(points, 1e-7 * size)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]], seams])
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) + 1e-12 * size
    # one entry per edge, since csr_array sums duplicates
    shortest = {(min(a, b), max(a, b)): d for (a, b), d in zip(edges.tolist(), length.tolist(), strict=True) if a != b}
    pairs = np.array(list(shortest), dtype=np.int64).reshape(-1, 2)
    graph = sp.csr_array((list(shortest.values()), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    far, _, source = csgraph.dijkstra(graph, directed=False, indices=weighted, min_only=True, return_predecessors=True)
    out = source[wanted]
    apart = ~np.isfinite(far[wanted])
    if apart.any():
        out[apart] = weighted[spatial.cKDTree(points[weighted]).query(points[wanted[apart]])[1]]
    return np.asarray(out, dtype=np.int64)
