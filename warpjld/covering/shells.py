"""Connected components (shells) of a surface, and the transfer of fields from the skin to shells that lie on it.

Fields are diffused along the surface, so those of nails, eyelashes, buttons and clothes would differ from the skin's
beneath, and part from it at joints. Their coefficients are therefore interpolated on the skin, their host:
``fields = shells(...).follow @ fields``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from warpjld.covering.bands import bands
from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.rotations import unit
from warpjld.runtime.query_mesh import query_mesh

__all__ = ["Shells", "shell_numbers", "shells"]

_SAMPLES = 16  # points on a segment from which rays are cast
_RAYS = 8  # rays around the segment from each of them, to find the shell that surrounds it
_OWN = 0.5  # share of a segment's length inside a shell that makes it a host (an eyeball at its bone's end has less)
_ACROSS = 0.25  # length of continued segments inside a shell, relative to its width, that does too (mannequins)
_SMALL = 1.5  # radius of a shell, in units of the host's thickness, up to which it moves rigidly
_PLACES = 16  # points of a small shell over which its rows are averaged
_SEAM = 1e-6  # relative to the surface's size: border vertices nearer than this coincide
_FURTHER = 0.5  # additional distance, in host thicknesses, allowed to a host face of the same orientation


@dataclass(frozen=True, eq=False)
class Shells:
    """Connected components of a surface, and the map of fields from hosts to shells that lie on them.

    Attributes:
        label: Shell of every vertex, shape (V,), numbered from 0; vertices without a face are shells of their own.
        host: Whether a shell is flesh around segments, shape (N,).
        lies: Whether a shell lies on a host, shape (N,): neither host nor rigid nor without faces.
        whole: Whether a lying shell moves rigidly, shape (N,): it is small compared with the host's thickness, or a
            closed band round the host (see ``bands``), and no border vertex lies on the host. All its rows of
            ``follow`` are equal, so with equal positions and rotations, and no rounding or muscle, it moves rigidly.
        follow: Interpolation weights, sparse (V, V), rows non-negative and summing to one: ``follow @ X`` are fields of
            the whole surface for fields X of the hosts. Rows of hosts and rigid vertices are the identity's, except
            that coincident border vertices of hosts get their mean.
        distance: Distance of a vertex of a lying shell from its host [m], 0 elsewhere, shape (V,).
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
    """Find the shells of a surface, and the host that each lies on.

    Hosts are the shells that segments run through: most rays from a segment hit them first. Clothes, however large, are
    hosts only where there is no skin inside them.

    Args:
        vertices: Rest surface, welded [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        lines: Ends of all segments at rest [m], shape (S, 2, 3).
        rigid: Joint that a vertex follows rigidly, -1 for flesh, shape (V,); by default all vertices are flesh.
    """
    count = len(vertices)
    flesh = np.ones(count, dtype=bool) if rigid is None else rigid < 0
    used = np.zeros(count, dtype=bool)
    used[faces.ravel()] = True
    seams = _seams(vertices, faces, flesh)
    label = shell_numbers(faces, count, seams)
    number = int(label.max()) + 1
    is_flesh = np.bincount(label, flesh & used, number) > 0
    host, lies = is_flesh, np.zeros(number, dtype=bool)
    whole = lies.copy()
    identity = sp.eye_array(count, format="csr")
    distance = np.zeros(count)
    if is_flesh.sum() > 1:
        host = _hosts(vertices, faces, lines, label, is_flesh)
        lies = is_flesh & ~host
    follow = _averaged_seams(seams, count) if len(seams) else identity
    if lies.any():
        rows, distance, whole = _follow(vertices, faces, lines, label, host, lies, flesh)
        # rows of lying shells are composed with those of hosts, whose coincident borders are averaged already
        free = sp.diags_array((~(lies[label] & flesh)).astype(np.float64))
        follow = sp.csr_array(free @ follow + rows @ follow)
    return Shells(label, host, lies, whole, follow, distance)


def shell_numbers(faces: NDArray[np.int32], count: int, seams: NDArray[np.int64] | None = None) -> NDArray[np.int32]:
    """Connected component of every vertex, shape (V,); ``seams`` are additional edges, shape (n, 2)."""
    links = np.concatenate([faces[:, :2], faces[:, 1:], *([] if seams is None else [seams])])
    graph = sp.coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    label: NDArray[np.int32] = connected_components(graph, directed=False)[1]
    return label


def _border(faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Boundary vertices: those on edges of a single face."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    half.sort(axis=1)
    base = int(faces.max()) + 1
    keys, times = np.unique(half[:, 0] * base + half[:, 1], return_counts=True)
    return np.unique(np.stack(np.divmod(keys[times == 1], base)))


def _seams(vertices: NDArray[np.float64], faces: NDArray[np.int32], flesh: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs of coincident boundary vertices of flesh, as where a body consists of several meshes, shape (n, 2)."""
    border = _border(faces)
    border = border[flesh[border]]
    size = float(np.linalg.norm(np.ptp(vertices[faces.ravel()], axis=0)))
    if len(border) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    from scipy.spatial import cKDTree  # its import takes a quarter of a second, and most skin is one shell

    return border[cKDTree(vertices[border]).query_pairs(_SEAM * size, output_type="ndarray")].reshape(-1, 2)


def _averaged_seams(seams: NDArray[np.int64], count: int) -> sp.csr_array:
    """Matrix that averages over coincident vertices, and is the identity for all others, shape (V, V)."""
    links = sp.coo_array((np.ones(len(seams)), (seams[:, 0], seams[:, 1])), shape=(count, count))
    group = connected_components(links, directed=False)[1]
    member = sp.csr_array((np.ones(count), (np.arange(count), group)))
    return sp.csr_array(member @ sp.diags_array(1.0 / member.sum(axis=0)) @ member.T)


def _hosts(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    lines: NDArray[np.float64],
    label: NDArray[np.int32],
    is_flesh: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Shells of flesh that surround a segment, or the one of the largest area where none does, shape (N,)."""
    import warp as wp
    from warpjld_kernels.shells import first_face_met

    number = len(is_flesh)
    of_face = label[faces[:, 0]]
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    along = lines[:, 1] - lines[:, 0]
    origins = lines[:, None, 0] + share[:, None] * along[:, None]
    forward = unit(along)
    across = unit(np.cross(forward, np.eye(3)[np.abs(forward).round(6).argmin(axis=1)]))
    angle = (np.arange(_RAYS) + 0.3) * (2.0 * np.pi / _RAYS)
    radial = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * np.cross(forward, across)[:, None]
    shape = (len(lines), _SAMPLES, _RAYS, 3)
    starts = np.broadcast_to(origins[:, :, None], shape).reshape(-1, 3)
    directions = np.broadcast_to(radial[:, None], shape).reshape(-1, 3)
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
    # a point of a segment lies inside the shell that most of its rays hit first
    inside = sp.csr_array(votes > _RAYS // 2).astype(np.float64)
    segment = sp.kron(sp.eye_array(len(lines)), np.full((1, _SAMPLES), 1.0 / _SAMPLES)).tocsr()
    shares = segment @ inside
    goes_on = (np.linalg.norm(lines[:, None, 1] - lines[None, :, 0], axis=2) < _SEAM * np.ptp(lines)).any(axis=1)
    length = shares.T @ (np.linalg.norm(along, axis=1) * goes_on)
    width = np.array([_spread(vertices, label, number, k) for k in range(3)]).max(axis=0)
    owned = shares.max(axis=0).toarray().ravel() >= _OWN
    host: NDArray[np.bool_] = is_flesh & (owned | (length >= _ACROSS * np.maximum(width, 1e-30)))
    if not host.any():  # the skeleton lies outside its surface
        edges = [vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2)]
        area = np.bincount(of_face, np.linalg.norm(np.cross(edges[0], edges[1]), axis=1), number)
        host[np.argmax(np.where(is_flesh, area, -1.0))] = True
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
    """Interpolation weights of lying vertices on hosts (V, V), distances [m] (V,), and which shells are rigid (N,)."""
    count, number = len(vertices), len(host)
    on = faces[(host[label] & flesh)[faces].all(axis=1)]
    lying = np.flatnonzero(lies[label] & flesh)
    of = label[lying]
    below = _mesh(vertices, on)
    place, face, weights, apart = _nearest(vertices, on, below, lying, np.zeros((len(lying), 3)), np.zeros(len(lying)))
    thick = _line_distance(place, lines)

    # an open shell is matched only to host faces of its own orientation, so that it does not stick to a neighbouring
    # finger; the sign of the mean says whether it is inside out. Closed shells have both orientations: no restriction
    normals = vertex_normals(vertices, faces).astype(np.float64)[lying]
    corner = vertices[on[face]]
    towards = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    sense = np.sign(np.bincount(of, (normals * towards).sum(axis=1), number))
    border = np.zeros(count, dtype=bool)
    border[_border(faces)] = True
    sheet = np.bincount(label, border, number) > 0
    normals = normals * (sense * sheet)[of][:, None]
    place, face, weights, apart = _nearest(vertices, on, below, lying, normals, _FURTHER * thick)

    mean = sp.csr_array((np.ones(len(lying)), (of, np.arange(len(lying)))), shape=(number, len(lying)))
    size = np.maximum(mean.sum(axis=1), 1.0)
    middle = (mean @ vertices[lying]) / size[:, None]
    reach = np.zeros(number)
    np.maximum.at(reach, of, np.linalg.norm(vertices[lying] - middle[of], axis=1))
    host_thick = (mean @ thick) / size
    around = bands(vertices[lying], of, unit(towards), host_thick)
    whole = lies & ((reach <= _SMALL * host_thick) | (around & ~sheet))
    # shells with border vertices on the skin bend with it, so that they do not tear off
    sewn = border[lying] & (apart < _SEAM * float(np.linalg.norm(np.ptp(vertices[faces.ravel()], axis=0))))
    whole[of[sewn]] = False

    rows = sp.csr_array((weights.ravel(), on[face].ravel(), np.arange(len(lying) + 1) * 3), shape=(len(lying), count))
    # a common row for all vertices of a small shell: the mean of those of a few distant vertices, weighted by how many
    # vertices are nearest to each
    small = np.flatnonzero(whole[of])
    if small.size:
        chosen = small[_far_apart(vertices[lying[small]], of[small], middle)]
        pick = sp.csr_array((np.ones(len(small)), (of[small], chosen)), shape=(number, len(lying)))
        common = sp.diags_array(1.0 / np.maximum(pick.sum(axis=1), 1.0)) @ (pick @ rows)
        spread = sp.csr_array((np.ones(len(small)), (small, of[small])), shape=(len(lying), number))
        rows = sp.diags_array((~whole[of]).astype(np.float64)) @ rows + spread @ common
    placed = sp.csr_array((np.ones(len(lying)), (lying, np.arange(len(lying)))), shape=(count, len(lying)))
    distance = np.zeros(count)
    distance[lying] = apart
    return sp.csr_array(placed @ rows), distance, whole


def _far_apart(points: NDArray[np.float64], of: NDArray[np.int32], middle: NDArray[np.float64]) -> NDArray[np.int64]:
    """Nearest sample of each point, shape (n,), by farthest-point sampling of ``_PLACES`` points in every shell."""
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
    lying: NDArray[np.int64],
    normals: NDArray[np.float64],
    further: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Closest points on ``faces`` of some vertices: points [m] (n, 3), faces (n,), barycentric weights (n, 3), and
    distances [m] (n,).

    Args:
        vertices: Positions [m], shape (V, 3).
        faces: Triangles of the hosts, shape (T, 3).
        below: Their mesh, from :func:`_mesh`.
        lying: Indices of the vertices, shape (n,).
        normals: Their normals, which faces must agree with; zero where any face will do, shape (n, 3).
        further: Additional distance allowed to a face that agrees [m], shape (n,).
    """
    import warp as wp
    from warpjld_kernels.shells import nearest_facing

    mesh, centre = below
    count = len(lying)
    inputs = [wp.array(a.astype(np.float32), dtype=wp.vec3, device="cpu") for a in (vertices[lying] - centre, normals)]
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
    """A Warp mesh for queries, relative to the mean of its vertices (float32 loses digits far from the origin), and
    that mean [m]."""
    centre = vertices[faces.ravel()].mean(axis=0)
    return query_mesh(vertices - centre, faces), centre


def _line_distance(points: NDArray[np.float64], lines: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance to the nearest line segment, shape (n,)."""
    best = np.full(len(points), np.inf)
    for start, end in lines:
        along = end - start
        t = np.clip((points - start) @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - start - t[:, None] * along, axis=1))
    return best
