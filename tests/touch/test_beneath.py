"""Depth beneath a mesh, averaged over near faces, beside sums over all its faces in float64."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from warpjld.geometry.normals import vertex_normals
from warpjld.touch.host_arrays import floats, numbers, vectors
from warpjld.touch.part_arrays import normal_arrays
from warpjld.touch.part_trees import part_trees

REACH, NARROWEST = 0.8, 1e-3


def bumpy_balls() -> tuple[NDArray[np.float64], list[NDArray[np.int32]]]:
    """Two bumpy balls side by side [m], and the faces of each; the second has a hole."""
    rings, around = 11, 14
    polar, turn = np.meshgrid(np.linspace(0.1, np.pi - 0.1, rings), np.arange(around) * 2.0 * np.pi / around)
    radius = 1.0 + 0.15 * np.sin(3.0 * polar) * np.cos(2.0 * turn)
    ball = radius[..., None] * np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1
    )
    number = np.arange(rings * around).reshape(around, rings)
    a, b = number[:, :-1].ravel(), number[:, 1:].ravel()
    c, d = np.roll(number, -1, axis=0)[:, 1:].ravel(), np.roll(number, -1, axis=0)[:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.int32)
    vertices = np.concatenate([ball.reshape(-1, 3), ball.reshape(-1, 3) + np.array([2.5, 0.0, 0.0])])
    return vertices, [faces, faces[:-29] + len(ball.reshape(-1, 3))]


def nearest_weights(point: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of the point of a triangle (3, 3) that is nearest: least squares with weights that sum to one."""
    heavy = 1e4
    matrix = np.vstack([(corners - point).T, np.full(3, heavy)])
    return np.asarray(nnls(matrix, np.array([0.0, 0.0, 0.0, heavy]))[0])


@cache
def kernel() -> Any:
    """A kernel that writes what ``beneath`` finds: distance, depth, mean normal, thickness and border."""
    import warp as wp
    from warpjld_kernels import touch_beneath

    @wp.kernel(module="unique")
    def measure(
        trees: touch_beneath.PartTrees,
        skin: touch_beneath.Normals,
        part: int,
        points: wp.array(dtype=wp.vec3),  # type: ignore[valid-type]
        out: wp.array2d(dtype=float),  # type: ignore[valid-type]
    ) -> None:
        i = wp.tid()
        found = touch_beneath.beneath(trees, skin, points, part, points[i], REACH, NARROWEST)
        mean = found.sure * found.normal
        out[i, 0] = found.least
        out[i, 1] = found.depth
        for k in range(3):
            out[i, 2 + k] = mean[k]
        out[i, 5] = found.thick
        out[i, 6] = found.border

    return measure


def beneath(
    vertices: NDArray[np.float64],
    meshes: list[NDArray[np.int32]],
    border: list[NDArray[np.float32]],
    thickness: NDArray[np.float64],
    points: list[NDArray[np.float64]],
) -> tuple[list[NDArray[np.float32]], NDArray[np.float32]]:
    """Per mesh, what is found at its points (n, 7); and the vertex normals used (V, 3)."""
    import warp as wp
    from warpjld_kernels import touch_trees

    wp.init()
    trees = part_trees(vertices, list(zip(meshes, border, strict=True)), thickness)
    normals = vertex_normals(vertices, np.concatenate(meshes))
    skin, ones = normal_arrays(vertices, np.concatenate(meshes)), np.ones(len(vertices))
    skin.unit, skin.plain, skin.known = vectors(normals), floats(ones), numbers(ones)
    wanted = numbers(np.ones(len(meshes)))
    wp.launch(touch_trees.fit_trees, len(meshes), inputs=[wanted, vectors(vertices), trees], device="cpu")
    found = []
    for part, places in enumerate(points):
        out = wp.zeros((len(places), 7), dtype=float, device="cpu")
        wp.launch(kernel(), len(places), inputs=[trees, skin, part, vectors(places), out], device="cpu")
        found.append(out.numpy())
    return found, normals


def test_means_over_near_faces_are_those_of_all_faces_measured_one_by_one() -> None:
    vertices, meshes = bumpy_balls()
    random = np.random.default_rng(3)
    border = [random.uniform(0.0, 1.0, f.shape).astype(np.float32) for f in meshes]
    thickness = random.uniform(0.5, 1.0, len(vertices))
    points = [random.normal(0.0, 0.45, (40, 3)) + np.array([2.5 * part, 0.0, 0.0]) for part in (0, 1)]
    found, normals = beneath(vertices, meshes, border, thickness, points)
    seen = 0
    for part, faces in enumerate(meshes):
        for point, got in zip(points[part], found[part], strict=True):
            expected = one_by_one(point, vertices, faces, normals, border[part], thickness)
            if expected is None:
                continue
            assert (got[0] < 0.0) == (expected[0] < 0.0)
            if got[0] >= 0.0:
                seen += 1
                np.testing.assert_allclose(got, expected, rtol=2e-3, atol=2e-4)
    assert seen > 40


def test_distances_to_triangles_of_any_shape_are_exact() -> None:
    random = np.random.default_rng(5)
    corners = random.uniform(-0.3, 0.3, (40, 3, 3))
    corners[:6, 1] = corners[:6, 0]  # edges and points instead of triangles, each corner first
    corners[2:4, 2] = corners[2:4, 0]
    corners[6:9, 2] = corners[6:9, 0]
    corners[9:12, 2] = 0.3 * corners[9:12, 0] + 0.7 * corners[9:12, 1]
    corners[12:15, 0] = 2.0 * corners[12:15, 1] - corners[12:15, 2]
    corners[15:20, 2] = corners[15:20, 0] + 1e-4 * (corners[15:20, 2] - corners[15:20, 0])
    meshes = [np.arange(3, dtype=np.int32)[None] + 3 * k for k in range(len(corners))]
    # all corners on the boundary: what side a point is on does not matter
    border = [np.zeros((1, 3), dtype=np.float32)] * len(corners)
    points = [random.uniform(-0.3, 0.3, (10, 3)) for _ in corners]
    found, _ = beneath(corners.reshape(-1, 3), meshes, border, np.ones(3 * len(corners)), points)
    for triangle, places, got in zip(corners, points, found, strict=True):
        weight = np.array([nearest_weights(point, triangle) for point in places])
        away = np.linalg.norm(places - weight @ triangle, axis=1)
        reached = away < 0.99 * REACH
        np.testing.assert_allclose(got[reached, 0], away[reached], rtol=1e-4, atol=1e-6)


def one_by_one(
    point: NDArray[np.float64],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    normals: NDArray[np.floating],
    border: NDArray[np.float32],
    thickness: NDArray[np.float64],
) -> Any:
    """Distance of the nearest face, negative where the point is not behind it, and the weighted means over near faces;
    None where several are equally near, as at an edge or corner, and not all have the point behind them.
    """
    corners = vertices[faces]
    weight = np.array([nearest_weights(point, c) for c in corners])
    away = point - np.einsum("fk,fki->fi", weight, corners)
    distance = np.linalg.norm(away, axis=1)
    normal = np.einsum("fk,fki->fi", weight, normals[faces])
    rim = (weight * border).sum(axis=1)
    behind = ((away * normal).sum(axis=1) < 0.0) | (rim < 0.5)
    best = int(distance.argmin())
    if len(set(behind[distance < distance[best] + 1e-5].tolist())) > 1:
        return None
    least = distance[best]
    if least >= REACH or not behind[best]:
        return np.full(7, -1.0)
    near = np.maximum(1.0 - (distance - least) / (0.5 * least + NARROWEST), 0.0) ** 2
    near *= np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    near /= near.sum()
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    depth = -(near * (away * unit).sum(axis=1)).sum()
    thick = (near * (weight * thickness[faces]).sum(axis=1)).sum()
    return np.array([least, depth, *(near @ unit), thick, (near * np.minimum(2.0 * rim, 1.0)).sum()])
