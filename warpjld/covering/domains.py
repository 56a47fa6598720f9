"""Domains of the operators with soft borders: from geometry alone by bone heat, or from painted weights.

Bone heat (Baran and Popović, Automatic Rigging and Animation of 3D Characters, 2007): every point is heated by the
nearest segment that it sees from inside the surface, and the heat spreads along the surface.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from warpjld.covering.corners import corner_conductivity
from warpjld.covering.operators import Fan
from warpjld.errors import InputError
from warpjld.normals import vertex_normals
from warpjld.rig import Skin
from warpjld.skeleton.tree import Skeleton

__all__ = ["domains_from_geometry", "domains_from_skin"]

_DIRECT_LIMIT = 20_000  # vertices up to which a sparse factorisation is quicker than multigrid


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
    H = contrast / distance². A larger contrast gives sharper borders.
    """
    owner, distance = _nearest_visible(vertices, faces, skeleton, groups)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    laplacian, area = _cotangent_laplacian(vertices, faces)
    heat = area * contrast / np.maximum(distance, 1e-4 * size) ** 2
    matrix = (laplacian + sp.diags_array(heat)).tocsc()
    source = np.zeros((len(vertices), len(groups)))
    source[np.arange(len(vertices)), owner] = heat
    present = np.flatnonzero(source.any(axis=0))
    weights = np.zeros_like(source)
    weights[:, present] = _solve(matrix, source[:, present])
    weights = np.maximum(weights, 0.0)
    return weights / weights.sum(axis=1, keepdims=True)


def domains_from_skin(
    vertices: NDArray[np.float64], skeleton: Skeleton, groups: tuple[Fan, ...], skin: Skin
) -> NDArray[np.float64]:
    """Painted weights as domains, shape (V, fans): the weight of a joint goes to the segments its bone carries.

    Where a bone carries segments of several fans the nearer ones get more, by inverse fourth power of the distance.

    Raises:
        InputError: Painted weights of another surface.
    """
    if skin.joints.shape != skin.weights.shape or len(skin.joints) != len(vertices):
        raise InputError(f"skin: want joints and weights of shape ({len(vertices)}, K), got {skin.weights.shape}")
    painted = np.zeros((len(vertices), len(skeleton)))
    np.add.at(painted, (np.arange(len(vertices))[:, None], skin.joints), skin.weights)
    carried = [
        [f for f, fan in enumerate(groups) if any(s.proximal == j for s in fan.segments)] for j in range(len(skeleton))
    ]
    for j in reversed(range(len(skeleton))):  # extremities carry nothing: their weight belongs to the bone before
        if not carried[j] and skeleton.parents[j] >= 0:
            painted[:, skeleton.parents[j]] += painted[:, j]
            painted[:, j] = 0.0
    out = np.zeros((len(vertices), len(groups)))
    for j, targets in enumerate(carried):
        touched = np.flatnonzero(painted[:, j])
        if not targets or not touched.size:
            continue
        closeness = np.column_stack([_fan_distance(vertices[touched], skeleton, groups[f]) ** -4.0 for f in targets])
        out[touched[:, None], targets] += painted[touched, j, None] * closeness / closeness.sum(axis=1, keepdims=True)
    total = out.sum(axis=1, keepdims=True)
    if (bare := np.flatnonzero(total[:, 0] <= 0.0)).size:
        raise InputError(f"skin: vertex {bare[0]} has no painted weight on any segment")
    return out / total


def _fan_distance(points: NDArray[np.float64], skeleton: Skeleton, fan: Fan) -> NDArray[np.float64]:
    distances = []
    for s in fan.segments:
        start, along = skeleton.rest[s.proximal], skeleton.rest[s.distal] - skeleton.rest[s.proximal]
        t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        distances.append(np.linalg.norm(points - start - t[:, None] * along, axis=1))
    return np.maximum(np.min(distances, axis=0), 1e-9)


def _nearest_visible(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], skeleton: Skeleton, groups: tuple[Fan, ...]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    import warp as wp
    from warpjld_kernels.visibility import nearest_visible_segment

    centre = vertices.mean(axis=0)  # float32 rays stay exact far from the origin
    segments = [s for fan in groups for s in fan.segments]
    fan_of = np.array([f for f, fan in enumerate(groups) for _ in fan.segments])
    device = "cpu"
    points = wp.array((vertices - centre).astype(np.float32), dtype=wp.vec3, device=device)
    mesh = wp.Mesh(points, wp.array(faces.ravel(), dtype=wp.int32, device=device))
    starts, ends = (
        wp.array(
            (skeleton.rest[[getattr(s, e) for s in segments]] - centre).astype(np.float32),
            dtype=wp.vec3,
            device=device,
        )
        for e in ("proximal", "distal")
    )
    normals = wp.array(vertex_normals(vertices, faces), dtype=wp.vec3, device=device)
    nearest = wp.empty(len(vertices), dtype=wp.int32, device=device)
    distance = wp.empty(len(vertices), dtype=float, device=device)
    inset = 1e-4 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    wp.launch(
        nearest_visible_segment,
        dim=len(vertices),
        inputs=[mesh.id, points, normals, inset, starts, ends],
        outputs=[nearest, distance],
        device=device,
    )
    return fan_of[nearest.numpy()], distance.numpy().astype(np.float64)


def _cotangent_laplacian(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Positive semidefinite cotangent Laplacian and barycentric vertex areas.

    Cotangents are kept within (0, 1e3): a weight of the wrong sign would let heat run uphill. Around saddle corners
    heat is conducted better, so that weights have no spike there.
    """
    count = len(vertices)
    conductivity = corner_conductivity(vertices, faces)
    rows, columns, values = [], [], []
    area = np.zeros(count)
    for k in range(3):
        apex, i, j = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        u, v = vertices[i] - vertices[apex], vertices[j] - vertices[apex]
        twice = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.clip((u * v).sum(axis=1) / np.maximum(twice, 1e-30), 1e-3, 1e3) / 2.0
        cotangent *= conductivity
        rows += [i, j]
        columns += [j, i]
        values += [-cotangent, -cotangent]
        np.add.at(area, apex, twice / 6.0)
    off = sp.coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count)
    ).tocsr()
    positive = area[area > 0.0]
    area = np.maximum(area, 1e-6 * positive.mean())  # vertices no face uses still belong somewhere
    return off + sp.diags_array(-np.asarray(off.sum(axis=1)).ravel()), area


def _solve(matrix: sp.csc_array, right: NDArray[np.float64]) -> NDArray[np.float64]:
    if matrix.shape[0] <= _DIRECT_LIMIT:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        solution: NDArray[np.float64] = factors.solve(right)
        return solution
    import pyamg

    multigrid = pyamg.smoothed_aggregation_solver(sp.csr_matrix(matrix))
    out = np.empty_like(right)
    for k in range(right.shape[1]):
        out[:, k], info = multigrid.solve(right[:, k], tol=1e-7, accel="cg", maxiter=200, return_info=True)
        if info:
            raise InputError(f"domains: heat did not settle in {info} iterations; is the mesh badly broken?")
    return out
