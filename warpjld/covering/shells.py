"""Shells of a surface that lie on others: nails, eyelashes, buttons and clothes follow the skin under them.

Heat runs along a surface, so whatever is not joined to the skin would find its own way at a joint and part from it.
Each coefficient of such a shell is therefore read from the host below: ``fields = shells(...).follow @ fields``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.rotations import unit

__all__ = ["Shells", "shell_numbers", "shells"]

_SAMPLES = 16  # places on a segment, and
_RAYS = 8  # rays from each of them around it, that ask which shell its flesh is
_OWN = 0.5  # share of a segment's length in a shell that makes it a host: an eyeball on its bone's end has less; or
_ACROSS = 0.25  # of the shell's own width in segments that go on: balls of a mannequin hide much of what lies between
_SMALL = 1.5  # a shell that reaches no further from its middle than so many host thicknesses stays rigid
_PLACES = 16  # of a small shell, whose mean says what it follows
_SEAM = 1e-6  # of the surface's size: borders nearer than this are one border
_FURTHER = 0.5  # host thicknesses that a shell may stand off so that it faces the same way as its host


@dataclass(frozen=True, eq=False)
class Shells:
    """Connected shells of a surface, and what the lying ones follow.

    Attributes:
        label: Shell of every vertex, shape (V,), numbered from 0; vertices without a face are shells of their own.
        host: Whether a shell is flesh around segments, shape (N,).
        lies: Whether a shell follows a host, shape (N,): neither host nor rigid nor without faces.
        whole: Whether a lying shell is small against what it lies on, with no border vertex on it, and follows as one,
            shape (N,). All rows of
            ``follow`` of such a shell are equal: with equal positions and rotations, and no rounding or muscle, it
            moves rigidly.
        follow: Sparse (V, V), rows non-negative and summing to one: fields X of the hosts make ``follow @ X`` those of
            the whole surface. Rows of hosts and of what is rigid are the identity's, but where borders of several
            hosts coincide the mean of those vertices.
        distance: How far a vertex of a lying shell is from its host [m], 0 elsewhere, shape (V,).
    """

    label: NDArray[np.int32]
    host: NDArray[np.bool_]
    lies: NDArray[np.bool_]
    whole: NDArray[np.bool_]
    follow: sp.csr_array
    distance: NDArray[np.float64]


def shells(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    lines: NDArray[np.float64],
    rigid: NDArray[np.int32] | None = None,
) -> Shells:
    """Find the shells of a surface, and what each lies on.

    Hosts are the shells that segments run through: seen from a segment, such a one is the first all round. Clothes are
    not while there is skin inside them, however large; where there is none they are.

    Args:
        vertices: Rest surface, welded [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        lines: Ends of all segments at rest [m], shape (S, 2, 3).
        rigid: Joint that a vertex follows rigidly, -1 for flesh, shape (V,); all is flesh by default.
    """
    count = len(vertices)
    flesh = np.ones(count, dtype=bool) if rigid is None else rigid < 0
    used = np.zeros(count, dtype=bool)
    used[faces.ravel()] = True
    seams = _seams(vertices, faces, flesh)
    label = shell_numbers(faces, count, seams)
    number = int(label.max()) + 1
    soft = np.bincount(label, flesh & used, number) > 0
    host, lies = soft, np.zeros(number, dtype=bool)
    whole = lies.copy()
    identity = sp.eye_array(count, format="csr")
    distance = np.zeros(count)
    if soft.sum() > 1:
        host = _hosts(vertices, faces, lines, label, soft)
        lies = soft & ~host
    follow = _joined(seams, count) if len(seams) else identity
    if lies.any():
        rows, distance, whole = _follow(vertices, faces, lines, label, host, lies, flesh)
        # rows of a shell that lies come from hosts; host borders that coincide are means already
        free = sp.diags_array((~(lies[label] & flesh)).astype(np.float64))
        follow = sp.csr_array(free @ follow + rows @ follow)
    return Shells(label, host, lies, whole, follow, distance)


def shell_numbers(faces: NDArray[np.int32], count: int, seams: NDArray[np.int64] | None = None) -> NDArray[np.int32]:
    """Number of the connected shell of every vertex, shape (V,); ``seams`` join pairs of vertices, shape (n, 2)."""
    links = np.concatenate([faces[:, :2], faces[:, 1:], *([] if seams is None else [seams])])
    graph = sp.coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    label: NDArray[np.int32] = connected_components(graph, directed=False)[1]
    return label


def _border(faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Vertices on edges of one face only."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    half.sort(axis=1)
    base = int(faces.max()) + 1
    keys, times = np.unique(half[:, 0] * base + half[:, 1], return_counts=True)
    return np.unique(np.stack(np.divmod(keys[times == 1], base)))


def _seams(vertices: NDArray[np.float64], faces: NDArray[np.int32], flesh: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs of border vertices of flesh at one place, as where a body is drawn as several meshes, shape (n, 2)."""
    border = _border(faces)
    border = border[flesh[border]]
    size = float(np.linalg.norm(np.ptp(vertices[faces.ravel()], axis=0)))
    if len(border) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    return border[cKDTree(vertices[border]).query_pairs(_SEAM * size, output_type="ndarray")].reshape(-1, 2)


def _joined(seams: NDArray[np.int64], count: int) -> sp.csr_array:
    """Mean over vertices that are one place, for all others the identity, shape (V, V)."""
    links = sp.coo_array((np.ones(len(seams)), (seams[:, 0], seams[:, 1])), shape=(count, count))
    group = connected_components(links, directed=False)[1]
    member = sp.csr_array((np.ones(count), (np.arange(count), group)))
    return sp.csr_array(member @ sp.diags_array(1.0 / member.sum(axis=0)) @ member.T)


def _hosts(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    lines: NDArray[np.float64],
    label: NDArray[np.int32],
    soft: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Shells of flesh that are first all round a segment, the largest where none is, shape (N,)."""
    import warp as wp
    from warpjld_kernels.shells import first_face_met

    number = len(soft)
    of_face = label[faces[:, 0]]
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    along = lines[:, 1] - lines[:, 0]
    origins = lines[:, None, 0] + share[:, None] * along[:, None]
    forward = unit(along)
    across = unit(np.cross(forward, np.eye(3)[np.abs(forward).round(6).argmin(axis=1)]))
    angle = (np.arange(_RAYS) + 0.3) * (2.0 * np.pi / _RAYS)
    ways = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * np.cross(forward, across)[:, None]
    shape = (len(lines), _SAMPLES, _RAYS, 3)
    starts = np.broadcast_to(origins[:, :, None], shape).reshape(-1, 3)
    directions = np.broadcast_to(ways[:, None], shape).reshape(-1, 3)
    mesh, centre = _mesh(vertices, faces)
    met = wp.empty(len(starts), dtype=wp.int32, device="cpu")
    rays = [wp.array((starts - centre).astype(np.float32), dtype=wp.vec3, device="cpu")]
    rays += [wp.array(directions.astype(np.float32), dtype=wp.vec3, device="cpu")]
    wp.launch(first_face_met, dim=len(starts), inputs=[mesh.id, 1e6, *rays], outputs=[met], device="cpu")
    face = met.numpy()
    sample = np.repeat(np.arange(len(lines) * _SAMPLES), _RAYS)
    hit = face >= 0
    votes = sp.coo_array(
        (np.ones(hit.sum()), (sample[hit], of_face[face[hit]])), shape=(len(lines) * _SAMPLES, number)
    ).tocsr()
    # the flesh of a place on a segment is what most rays meet first
    inside = sp.csr_array(votes > _RAYS // 2).astype(np.float64)
    segment = sp.kron(sp.eye_array(len(lines)), np.full((1, _SAMPLES), 1.0 / _SAMPLES)).tocsr()
    shares = segment @ inside
    goes_on = (np.linalg.norm(lines[:, None, 1] - lines[None, :, 0], axis=2) < _SEAM * np.ptp(lines)).any(axis=1)
    length = shares.T @ (np.linalg.norm(along, axis=1) * goes_on)
    width = np.array([_spread(vertices, label, number, k) for k in range(3)]).max(axis=0)
    owned = shares.max(axis=0).toarray().ravel() >= _OWN
    host: NDArray[np.bool_] = soft & (owned | (length >= _ACROSS * np.maximum(width, 1e-30)))
    if not host.any():  # a skeleton outside its surface
        edges = [vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2)]
        area = np.bincount(of_face, np.linalg.norm(np.cross(edges[0], edges[1]), axis=1), number)
        host[np.argmax(np.where(soft, area, -1.0))] = True
    return host


def _spread(vertices: NDArray[np.float64], label: NDArray[np.int32], number: int, axis: int) -> NDArray[np.float64]:
    """Extent of every shell along an axis [m], shape (N,)."""
    low, high = np.full(number, np.inf), np.full(number, -np.inf)
    np.minimum.at(low, label, vertices[:, axis])
    np.maximum.at(high, label, vertices[:, axis])
    return high - low


def _follow(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    lines: NDArray[np.float64],
    label: NDArray[np.int32],
    host: NDArray[np.bool_],
    lies: NDArray[np.bool_],
    flesh: NDArray[np.bool_],
) -> tuple[sp.csr_array, NDArray[np.float64], NDArray[np.bool_]]:
    """Rows of lying vertices over those of hosts, shape (V, V), distances (V,), and whole shells (N,)."""
    count, number = len(vertices), len(host)
    on = faces[(host[label] & flesh)[faces].all(axis=1)]
    some = np.flatnonzero(lies[label] & flesh)
    of = label[some]
    below = _mesh(vertices, on)
    place, face, weights, apart = _nearest(vertices, on, below, some, np.zeros((len(some), 3)), np.zeros(len(some)))
    thick = _line_distance(place, lines)

    # where a shell faces the skin it lies on, it may not stick to a neighbour's; one with an inner side, or one
    # drawn inside out, is asked accordingly
    normals = vertex_normals(vertices, faces).astype(np.float64)[some]
    corner = vertices[on[face]]
    towards = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    sense = np.sign(np.bincount(of, (normals * towards).sum(axis=1), number))
    border = np.zeros(count, dtype=bool)
    border[_border(faces)] = True
    sheet = np.bincount(label, border, number) > 0
    normals = normals * (sense * sheet)[of][:, None]
    place, face, weights, apart = _nearest(vertices, on, below, some, normals, _FURTHER * thick)

    mean = sp.csr_array((np.ones(len(some)), (of, np.arange(len(some)))), shape=(number, len(some)))
    size = np.maximum(mean.sum(axis=1), 1.0)
    middle = (mean @ vertices[some]) / size[:, None]
    reach = np.zeros(number)
    np.maximum.at(reach, of, np.linalg.norm(vertices[some] - middle[of], axis=1))
    whole = lies & (reach <= _SMALL * (mean @ thick) / size)
    # whose border is sewn to the skin bends with it, or it would tear off
    sewn = border[some] & (apart < _SEAM * float(np.linalg.norm(np.ptp(vertices[faces.ravel()], axis=0))))
    whole[of[sewn]] = False

    rows = sp.csr_array((weights.ravel(), on[face].ravel(), np.arange(len(some) + 1) * 3), shape=(len(some), count))
    # one row of a small shell for all of it: mean of a few of its vertices far apart, each for those around it
    small = np.flatnonzero(whole[of])
    if small.size:
        chosen = small[_far_apart(vertices[some[small]], of[small], middle)]
        pick = sp.csr_array((np.ones(len(small)), (of[small], chosen)), shape=(number, len(some)))
        common = sp.diags_array(1.0 / np.maximum(pick.sum(axis=1), 1.0)) @ (pick @ rows)
        spread = sp.csr_array((np.ones(len(small)), (small, of[small])), shape=(len(some), number))
        rows = sp.diags_array((~whole[of]).astype(np.float64)) @ rows + spread @ common
    placed = sp.csr_array((np.ones(len(some)), (some, np.arange(len(some)))), shape=(count, len(some)))
    distance = np.zeros(count)
    distance[some] = apart
    return sp.csr_array(placed @ rows), distance, whole


def _far_apart(points: NDArray[np.float64], of: NDArray[np.int32], middle: NDArray[np.float64]) -> NDArray[np.int64]:
    """The chosen point that stands for each point, shape (n,): some of its shell, each as far as can be from others."""
    stands = np.zeros(len(points), dtype=np.int64)
    reach = np.linalg.norm(points - middle[of], axis=1)
    last = np.zeros(len(middle), dtype=np.int64)
    for k in range(_PLACES):
        order = np.lexsort((reach, of))
        ends = order[np.append(np.flatnonzero(np.diff(of[order])), len(order) - 1)]
        last[of[ends]] = ends
        apart = np.linalg.norm(points - points[last[of]], axis=1)
        nearer = (apart < reach) | (k == 0)
        stands, reach = np.where(nearer, last[of], stands), np.where(nearer, apart, reach)
    return stands


def _nearest(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    below: tuple[Any, NDArray[np.float64]],
    some: NDArray[np.int64],
    normals: NDArray[np.float64],
    further: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Nearest place on ``faces``, which ``below`` holds, of some vertices: it (n, 3), face (n,), weights (n, 3),
    distance (n,)."""
    import warp as wp
    from warpjld_kernels.shells import nearest_facing

    mesh, centre = below
    count = len(some)
    inputs = [wp.array(a.astype(np.float32), dtype=wp.vec3, device="cpu") for a in (vertices[some] - centre, normals)]
    inputs.append(wp.array(further.astype(np.float32), dtype=float, device="cpu"))
    kinds = (wp.int32, wp.vec3, float)
    out = [wp.empty(count, dtype=kind, device="cpu") for kind in kinds]
    wp.launch(nearest_facing, dim=count, inputs=[mesh.id, 1e6, *inputs], outputs=out, device="cpu")
    face, weights, distance = (a.numpy() for a in out)
    weights = np.maximum(weights.astype(np.float64), 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    place = np.einsum("nk,nkd->nd", weights, vertices[faces[face]])
    return place, face, weights, distance.astype(np.float64)


def _mesh(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[Any, NDArray[np.float64]]:
    """A mesh to ask, about its own middle: far from the origin float32 would cost digits."""
    import warp as wp

    centre = vertices[faces.ravel()].mean(axis=0)
    points = wp.array((vertices - centre).astype(np.float32), dtype=wp.vec3, device="cpu")
    return wp.Mesh(points, wp.array(faces.astype(np.int32).ravel(), dtype=wp.int32, device="cpu")), centre


def _line_distance(points: NDArray[np.float64], lines: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance to the nearest line segment, shape (n,)."""
    best = np.full(len(points), np.inf)
    for start, end in lines:
        along = end - start
        t = np.clip((points - start) @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - start - t[:, None] * along, axis=1))
    return best
