"""Moving the nodes of a mesh so that its elements are well shaped.

Minimises, over all corners of all elements, the shape measure |A|³ / (3√3 det A) of the corner's three edges A (1 for
a cube), with the determinant regularised so that corners turned inside out can be turned back (Escobar et al. 2003,
doi:10.1016/S0045-7825(03)00299-8), and pulls boundary nodes to the tangent planes they belong to.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.launch import Launch, shared, threads_of
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.solver.lbfgs import minimise

__all__ = ["as_far", "improve"]


def improve(
    nodes: Array,
    elements: Ints32,
    spacing: float,
    boundary: Ints,
    targets: Array,
    normals: Array,
    *,
    pull: Array,
    slide: float | Array = 0.02,
    softness: float = 0.1,
    rounds: int = 60,
    still: Mask | None = None,
) -> Array:
    """Better positions of the nodes.

    Args:
        nodes: [m], shape (N, 3).
        elements: Corners, shape (E, 8).
        spacing: Edge length that is wanted [m].
        boundary: Nodes pulled to the surface, shape (B,).
        targets: Their closest points on it [m], shape (B, 3).
        normals: Its normals there, shape (B, 3).
        pull: Weight of each one's distance along the normal, shape (B,); across it a node slides almost freely.
        slide: Weight of the distance across the normal, relative to ``pull``: one for all, or each one's, shape (B,).
        softness: Regularisation of the determinant; the smaller, the more worst corners count.
        rounds: Iterations.
        still: Nodes that stay where they are, shape (N,).
    """
    import warp as wp
    from warpjld_kernels import fem_shape_measure

    count = len(nodes)
    sliding = np.broadcast_to(np.asarray(slide, dtype=np.float64), (len(boundary),))
    flat = elements.ravel()
    x = np.ascontiguousarray(nodes / spacing)
    costs = np.empty(len(elements))
    slopes = np.empty((len(elements), 8, 3))
    launch = Launch(
        fem_shape_measure.measure,
        len(elements),
        [
            shared(np.ascontiguousarray(elements)),
            wp.float64(softness),
            wp.array(x, dtype=wp.vec3d, device="cpu", copy=False),
            shared(costs),
            wp.array(slopes, dtype=wp.vec3d, device="cpu", copy=False),
        ],
        threads=threads_of(),
    )

    def cost(vector: Array) -> tuple[float, Array]:
        x[:] = vector.reshape(-1, 3)
        launch()
        gradient: Array = np.stack(
            [np.bincount(flat, weights=slopes[:, :, k].ravel(), minlength=count) for k in range(3)], axis=1
        )
        away = x[boundary] - targets
        along = np.einsum("bi,bi->b", away, normals)
        squared = np.einsum("bi,bi->b", away, away)
        value = float(costs.sum()) + float((pull * (along * along + sliding * squared)).sum())
        gradient[boundary] += 2.0 * pull[:, None] * (along[:, None] * normals + sliding[:, None] * away)
        if still is not None:
            gradient[still] = 0.0
        return value, np.asarray(gradient, dtype=np.float64).reshape(-1)

    targets = targets / spacing
    start = (nodes / spacing).reshape(-1)
    improved: Array = minimise(cost, start, rounds=rounds, first_step=0.05).reshape(-1, 3) * spacing
    return improved


def as_far(mesh: HexMesh, start: Array, goal: Array, least: float | Array, shorter: float) -> HexMesh:
    """The mesh with its nodes moved from a start towards a goal, less far where elements would become too bad.

    Args:
        mesh: Its elements.
        start: [m], shape (N, 3).
        goal: [m], shape (N, 3).
        least: Scaled Jacobian that elements keep: one for all, or each one's, shape (E,).
        shorter: Share of their way that the nodes of worse ones go instead, again and again.
    """
    share = np.ones((len(start), 1))
    for _ in range(16):
        moved = replace(mesh, nodes=start + share * (goal - start))
        bad = moved.scaled_jacobian() < least
        if not bad.any():
            break
        share[np.unique(mesh.elements[bad])] *= shorter
    return moved
