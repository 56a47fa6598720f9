"""Domains of the operators, with soft borders: from geometry alone by bone heat, or from painted weights.

Bone heat (Baran and Popović, *Automatic Rigging and Animation of 3D Characters*, 2007): every vertex is heated by the
nearest segment that is visible from it inside the surface, and the heat diffuses along the surface.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.heat import solve_diffusion
from warpjld.covering.laplacian import cotangent_laplacian, uniform_laplacian
from warpjld.covering.operators import Fan, segment_ends
from warpjld.covering.skull import skull_lines
from warpjld.errors import InputError
from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.spatial_order import spatial_order
from warpjld.geometry.spread import spread
from warpjld.rig import Skin
from warpjld.runtime.lazily import lazy_module
from warpjld.runtime.query_mesh import query_mesh
from warpjld.runtime.threads import in_threads, threads_for
from warpjld.skeleton.tree import Skeleton

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["domains_from_geometry", "domains_from_skin"]

_LARGEST = 10.0  # upper bound of the surface's size in units of the skeleton's, against stray vertices far out
_NOTHING = 1e-6  # sum of painted weights below which a vertex counts as unpainted
_THREAD = 2_000  # smallest number of points worth a thread of its own
_TOGETHER = 4_096  # points whose distances from all segments are stored at once, which bounds memory
_TIE = 1e-5  # relative to the skeleton's size: smaller differences of distances (float32 rounding) count as ties


def domains_from_geometry(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    skeleton: Skeleton,
    groups: tuple[Fan, ...],
    *,
    contrast: float = 2.0,
) -> NDArray[np.float64]:
    """Weight of every fan at every vertex, rows summing to one, shape (V, fans).

    Solves (L + A H) w = A H p: L the cotangent Laplacian, A vertex areas, p the nearest visible fan,
    H = contrast / distance². A larger contrast gives sharper borders. Where the cotangent weights and areas of a
    degenerate mesh give no solution, all edges get the same conductivity and all vertices the same area.

    Raises:
        InputError: There is no solution even so.
    """
    # centred, and in units of the skeleton's size: neither units nor distance from the origin may cost digits
    centre, unit = skeleton.rest.mean(axis=0), float(np.linalg.norm(np.ptp(skeleton.rest, axis=0)))
    points = (vertices - centre) / unit
    faces = _distinct(faces)
    size = min(float(np.linalg.norm(np.ptp(points, axis=0))), _LARGEST)
    lines, fan_of = _lines(skeleton, vertices, faces, groups)
    owner, distance = _nearest_visible(points, faces, (lines - centre) / unit, fan_of, min(size, 1.0))
    size = max(size, 1e-3)
    # far from every segment the diffusion length is bounded by the size of the surface
    demand = contrast / np.clip(distance, 1e-4 * size, size) ** 2
    present, column = np.unique(owner, return_inverse=True)
    rows, shape = np.arange(len(vertices)), (len(vertices), len(present))
    laplacian, area = cotangent_laplacian(points, faces, np.minimum(distance, size))
    order = spatial_order(points)
    for conducting, cover in (
        (lambda: laplacian, area),
        (lambda: uniform_laplacian(faces, len(vertices)), np.full(len(vertices), area.mean())),
    ):
        heat = cover * demand
        source = sp.coo_array((heat, (rows, column)), shape=shape)
        found = solve_diffusion(conducting() + sp.diags_array(heat), source, order)
        if found is None:
            continue
        np.maximum(found, 0.0, out=found)  # in place: of a large body it is a fifth of a gigabyte
        if (total := found.sum(axis=1)).min() > 0.5:
            found /= total[:, None]
            if len(present) == len(groups):
                return found
            weights = np.zeros((len(vertices), len(groups)))
            weights[:, present] = found
            return weights
    raise InputError(
        "domains: heat diffusion has no solution on this surface; try --domains skin if the rig has painted weights, "
        "or repair the mesh (merge coincident vertices, remove faces without area and vertices far from all others)"
    )


def domains_from_skin(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    skeleton: Skeleton,
    groups: tuple[Fan, ...],
    skin: Skin,
) -> NDArray[np.float64]:
    """Painted weights as domains, shape (V, fans): the weight of a joint goes to the segments that begin at it.

    Where segments of several fans begin at a joint, its weight is shared by the inverse fourth power of the distance.
    A vertex without weight on any segment takes its neighbours' weights.

    Raises:
        InputError: Painted weights of another surface, weights that are not finite, or none on any segment.
    """
    if skin.joints.shape != skin.weights.shape or len(skin.joints) != len(vertices):
        raise InputError(f"skin: want joints and weights of shape ({len(vertices)}, K), got {skin.weights.shape}")
    if not np.isfinite(skin.weights).all():
        raise InputError(f"skin: the weights of vertex {np.argwhere(~np.isfinite(skin.weights))[0][0]} are not finite")
    painted = np.zeros((len(vertices), len(skeleton)))
    np.add.at(painted, (np.arange(len(vertices))[:, None], skin.joints), skin.weights)
    carried = [
        [f for f, fan in enumerate(groups) if any(s.proximal == j for s in fan.segments)] for j in range(len(skeleton))
    ]
    for j in reversed(range(len(skeleton))):  # no segment begins at an extremity: its weight goes to its parent
        if not carried[j] and skeleton.parents[j] >= 0:
            painted[:, skeleton.parents[j]] += painted[:, j]
            painted[:, j] = 0.0
    out = np.zeros((len(vertices), len(groups)))
    for j, targets in enumerate(carried):
        touched = np.flatnonzero(painted[:, j])
        if not targets or not touched.size:
            continue
        apart = np.column_stack([_fan_distance(vertices[touched], skeleton, groups[f]) for f in targets])
        closeness = (apart.min(axis=1, keepdims=True) / apart) ** 4
        out[touched[:, None], targets] += painted[touched, j, None] * closeness / closeness.sum(axis=1, keepdims=True)
    known = out.sum(axis=1) > _NOTHING
    if not known.any():
        raise InputError("skin: no vertex has painted weight on any segment; use --domains geometry")
    out[known] /= out[known].sum(axis=1, keepdims=True)
    return spread(out, known, vertices, faces)


def _fan_distance(points: NDArray[np.float64], skeleton: Skeleton, fan: Fan) -> NDArray[np.float64]:
    """Distance of points from the nearest segment of a fan [m], shape (n,)."""
    distances = []
    for s in fan.segments:
        start, along = skeleton.rest[s.proximal], skeleton.rest[s.distal] - skeleton.rest[s.proximal]
        t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        distances.append(np.linalg.norm(points - start - t[:, None] * along, axis=1))
    return np.maximum(np.min(distances, axis=0), 1e-9)


def _distinct(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Faces with three different corners, each once regardless of orientation: duplicates would conduct twice."""
    corners = np.sort(faces, axis=1)
    solid = np.flatnonzero((corners[:, 0] < corners[:, 1]) & (corners[:, 1] < corners[:, 2]))
    first = np.unique(corners[solid], axis=0, return_index=True)[1]
    if not first.size:
        return faces
    kept: NDArray[np.int32] = faces[solid[np.sort(first)]]
    return kept


def _lines(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32], groups: tuple[Fan, ...]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Line segments that heat the surface, and the fan of each: all segments, and further lines of the skull.

    Returns:
        End points [m], shape (L, 2, 3), and fans, shape (L,).
    """
    lines = list(skeleton.rest[segment_ends(groups)])
    fan_of = [f for f, fan in enumerate(groups) for _ in fan.segments]
    for f, fan in enumerate(groups):
        if fan.stiff:
            more = [np.stack(line) for line in skull_lines(skeleton, vertices, faces)]
            lines += more
            fan_of += [f] * len(more)
    return np.array(lines), np.array(fan_of)


def _nearest_visible(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    lines: NDArray[np.float64],
    fan_of: NDArray[np.int64],
    size: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Fan of the nearest line (L, 2, 3) visible from each point inside the surface, and its distance, shape (V,) each.

    Offsets of rays and ties of distances are relative to ``size``.
    """
    import warp as wp
    from warpjld_kernels.visibility import LANES, nearest_visible_segment

    device = "cpu"
    places = wp.array(points.astype(np.float32), dtype=wp.vec3, device=device)
    mesh = query_mesh(places, faces)
    tips = [wp.array(lines[:, k].astype(np.float32), dtype=wp.vec3, device=device) for k in (0, 1)]
    normals = wp.array(vertex_normals(points, faces), dtype=wp.vec3, device=device)
    nearest = wp.empty(len(points), dtype=wp.int32, device=device)
    distance = wp.empty(len(points), dtype=float, device=device)

    def span(begin: int, end: int) -> None:
        width = -(-len(lines) // LANES) * LANES
        scratch = wp.empty((min(_TOGETHER, end - begin), width), dtype=float, device=device)
        for first in range(begin, end, _TOGETHER):
            block = slice(first, min(first + _TOGETHER, end))
            wp.launch(
                nearest_visible_segment,
                dim=block.stop - first,
                inputs=[mesh.id, places[block], normals[block], 1e-4 * size, _TIE * size, *tips, scratch],
                outputs=[nearest[block], distance[block]],
                device=device,
            )

    in_threads(span, len(points), threads_for(len(points), _THREAD), nearest_visible_segment, device)
    return fan_of[nearest.numpy()], distance.numpy().astype(np.float64)
