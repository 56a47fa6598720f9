"""Quality measures of a deformed surface: enclosed volume, edge stretch, reversed edges and faces. All in float64."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
    from scipy.sparse import csgraph
    from scipy.spatial import transform
else:
    sp = lazy_module("scipy.sparse")
    csgraph = lazy_module("scipy.sparse.csgraph")
    transform = lazy_module("scipy.spatial.transform")

__all__ = [
    "Stretch",
    "closing_fans",
    "edge_stretch",
    "enclosed_volume",
    "reversed_edges",
    "reversed_faces",
    "unique_edges",
]


@dataclass(frozen=True)
class Stretch:
    """Distribution of edge length over rest length: smallest, 1st and 99th percentile, largest."""

    smallest: float
    low: float
    high: float
    largest: float

    @staticmethod
    def of(ratios: NDArray[np.float64]) -> Stretch:
        """Distribution of the ratios of one frame, shape (E,)."""
        low, high = np.percentile(ratios, [1.0, 99.0])
        return Stretch(float(ratios.min()), float(low), float(high), float(ratios.max()))

    def __str__(self) -> str:
        return f"{self.smallest:.2f} {self.low:.2f} {self.high:.2f} {self.largest:.2f}"


def closing_fans(faces: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Boundary edges of an open surface and their loops, from which triangle fans that close it are made.

    An edge (a, b) of loop l stands for the triangle b, a, c with c the mean of the vertices of l, so that a hand that
    is open at the wrist has a volume. Closed surfaces have no such edges.

    Returns:
        Boundary edges in the direction of their faces, shape (B, 2), and loop numbers from 0, shape (B,).
    """
    half = _half_edges(faces).astype(np.int64)
    base = int(faces.max()) + 1
    boundary = half[~np.isin(half[:, 0] * base + half[:, 1], half[:, 1] * base + half[:, 0])]
    if not len(boundary):
        return boundary, np.zeros(0, dtype=np.int64)
    rims, compact = np.unique(boundary, return_inverse=True)
    compact = compact.reshape(boundary.shape)
    links = sp.coo_array((np.ones(len(compact)), (compact[:, 0], compact[:, 1])), shape=(len(rims),) * 2)
    label = csgraph.connected_components(links, directed=False)[1]
    return boundary, label[compact[:, 0]].astype(np.int64)


def enclosed_volume(vertices: ArrayLike, faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Signed volume [m³] by the divergence theorem, V = Σ a · (b × c) / 6, boundary loops closed by fans.

    Args:
        vertices: Positions [m], shape (..., V, 3).
        faces: Triangles, shape (T, 3); positive volume where they are anticlockwise seen from outside.

    Returns:
        Shape (...), a zero-dimensional array for one frame.
    """
    points = np.asarray(vertices, dtype=np.float64)
    points = points - points.mean(axis=-2, keepdims=True)  # against cancellation far from the origin
    a, b, c = (points[..., faces[:, k], :] for k in range(3))
    six = np.einsum("...ti,...ti->...", a, np.cross(b, c))
    boundary, loop = closing_fans(faces)
    for number in range(int(loop.max()) + 1 if len(loop) else 0):
        start, end = (points[..., boundary[loop == number, k], :] for k in (0, 1))
        centre = start.mean(axis=-2)
        six = six + np.einsum("...ti,...i->...", np.cross(end, start), centre)
    return np.asarray(six / 6.0)


def unique_edges(faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Edges of a triangulation, each once, shape (E, 2)."""
    half = np.sort(_half_edges(faces).astype(np.int64), axis=1)
    base = int(faces.max()) + 1
    keys = np.unique(half[:, 0] * base + half[:, 1])
    return np.stack(np.divmod(keys, base), axis=1)


def edge_stretch(rest: ArrayLike, vertices: ArrayLike, edges: NDArray[np.int64]) -> NDArray[np.float64]:
    """Edge lengths over rest lengths, shape (..., E). Edges without length at rest count as unstretched.

    Args:
        rest: Rest positions [m], shape (V, 3).
        vertices: Positions [m], shape (..., V, 3).
        edges: From :func:`unique_edges`, shape (E, 2).
    """
    before = np.linalg.norm(_along(rest, edges), axis=-1)
    after = np.linalg.norm(_along(vertices, edges), axis=-1)
    solid = before > 1e-12 * max(float(before.max(initial=0.0)), 1e-300)
    return np.where(solid, after / np.where(solid, before, 1.0), 1.0)


def reversed_edges(
    rest: ArrayLike, vertices: ArrayLike, edges: NDArray[np.int64], rotations: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Edges whose direction is opposite to the rest edge turned by the rotation of its ends, shape (..., E).

    Along a tube this is a cross-section that has passed its neighbour.

    Args:
        rest: Rest positions [m], shape (V, 3).
        vertices: Positions [m], shape (..., V, 3).
        edges: From :func:`unique_edges`, shape (E, 2).
        rotations: Rotation of each vertex's part of the skeleton, x y z w, shape (..., V, 4).
    """
    carried = _carry(_along(rest, edges), rotations, edges)
    return np.asarray((carried * _along(vertices, edges)).sum(axis=-1) < 0.0)


def reversed_faces(
    rest: ArrayLike, vertices: ArrayLike, faces: NDArray[np.int32], rotations: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Faces whose normal is opposite to the rest normal turned by the rotation of their corners, shape (..., T).

    Arguments as for :func:`reversed_edges`, with triangles (T, 3).
    """
    carried = _carry(_normals(rest, faces), rotations, faces)
    return np.asarray((carried * _normals(vertices, faces)).sum(axis=-1) < 0.0)


def _half_edges(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _along(points: ArrayLike, edges: NDArray[np.int64]) -> NDArray[np.float64]:
    p = np.asarray(points, dtype=np.float64)
    return np.asarray(p[..., edges[:, 1], :] - p[..., edges[:, 0], :])


def _normals(points: ArrayLike, faces: NDArray[np.int32]) -> NDArray[np.float64]:
    p = np.asarray(points, dtype=np.float64)
    a, b, c = (p[..., faces[:, k], :] for k in range(3))
    return np.cross(b - a, c - a)


def _carry(vectors: NDArray[np.float64], rotations: NDArray[np.float64], corners: NDArray) -> NDArray[np.float64]:
    """Vectors at rest (N, 3) turned by the mean rotation of their corners (N, k), shape (..., N, 3)."""
    turn = rotations[..., corners, :].sum(axis=-2)
    shape = (*turn.shape[:-1], 3)
    flat = transform.Rotation.from_quat(turn.reshape(-1, 4)).apply(
        np.broadcast_to(vectors, shape).reshape(-1, 3).copy()
    )
    return np.asarray(flat.reshape(shape))
