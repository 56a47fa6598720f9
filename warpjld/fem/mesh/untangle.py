"""Mesh untangling and smoothing by a regularised shape measure.

Minimises, over all corners of all elements, the shape measure |A|³ / (3√3 det A) of the corner's three edges A (1 for
a cube), with the determinant regularised so that inverted corners can recover (Escobar et al. 2003,
doi:10.1016/S0045-7825(03)00299-8), and pulls boundary nodes to their tangent planes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask, dot, norm
from warpjld.fem.launch import Launch, shared, threads_of
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["as_far", "improve", "lbfgs"]


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
    """Optimised positions of the nodes [m], shape (N, 3).

    Args:
        nodes: Initial positions [m], shape (N, 3).
        elements: Nodes of the elements, shape (E, 8).
        spacing: Desired edge length [m].
        boundary: Nodes pulled to the surface, shape (B,).
        targets: Their closest points on it [m], shape (B, 3).
        normals: Its normals there, shape (B, 3).
        pull: Weight of each node's distance along the normal, shape (B,).
        slide: Weight of the tangential distance, relative to ``pull``: one for all, or one per node, shape (B,).
        softness: Regularisation of the determinant; the smaller, the larger the influence of the worst corners.
        rounds: Number of iterations.
        still: Mask of fixed nodes, shape (N,).
    """
    sliding = np.broadcast_to(np.asarray(slide, dtype=np.float64), (len(boundary),))
    measure = _ShapeMeasure(nodes / spacing, elements, softness)

    def cost(vector: Array) -> tuple[float, Array]:
        value, gradient = measure.at(vector.reshape(-1, 3))
        away = measure.x[boundary] - targets
        along = np.einsum("bi,bi->b", away, normals)
        squared = np.einsum("bi,bi->b", away, away)
        value += float((pull * (along * along + sliding * squared)).sum())
        gradient[boundary] += 2.0 * pull[:, None] * (along[:, None] * normals + sliding[:, None] * away)
        if still is not None:
            gradient[still] = 0.0
        return value, np.asarray(gradient, dtype=np.float64).reshape(-1)

    targets = targets / spacing
    start = (nodes / spacing).reshape(-1)
    improved: Array = lbfgs(cost, start, rounds=rounds, first_step=0.05).reshape(-1, 3) * spacing
    return improved


class _ShapeMeasure:
    """Sum of the corners' shape measures at nodes x (n, 3), and its gradient (n, 3)."""

    def __init__(self, x: Array, elements: Ints32, softness: float) -> None:
        import warp as wp
        from warpjld_kernels import fem_shape_measure

        self.x = np.ascontiguousarray(x)
        flat = elements.ravel()
        starts = np.zeros(len(x) + 1, np.int32)
        np.cumsum(np.bincount(flat, minlength=len(x)), out=starts[1:])
        corners = np.argsort(flat, kind="stable").astype(np.int32)
        self._costs, self._slope = np.empty(len(elements)), np.empty((len(x), 3))
        slopes = np.empty((len(elements), 8, 3))
        x_, each, slope = (wp.array(a, dtype=wp.vec3d, device="cpu", copy=False) for a in (self.x, slopes, self._slope))
        inputs = [shared(np.ascontiguousarray(elements)), wp.float64(softness), x_, shared(self._costs), each]
        parts = [shared(starts), shared(corners), each.flatten(), slope]
        self._launches = [
            Launch(fem_shape_measure.measure, len(elements), inputs, threads=threads_of()),
            Launch(fem_shape_measure.gather, len(x), parts, threads=threads_of()),
        ]

    def at(self, x: Array) -> tuple[float, Array]:
        self.x[:] = x
        for launch in self._launches:
            launch()
        return float(self._costs.sum()), self._slope.copy()


def as_far(mesh: HexMesh, start: Array, goal: Array, least: float | Array, shorter: float) -> HexMesh:
    """The mesh with nodes moved from a start towards a goal, less far where elements would become bad.

    Args:
        mesh: Mesh with the elements.
        start: Initial positions [m], shape (N, 3).
        goal: Target positions [m], shape (N, 3).
        least: Smallest scaled Jacobian of elements: one for all, or one per element, shape (E,).
        shorter: Factor by which the displacement of nodes of bad elements is repeatedly reduced.
    """
    share = np.ones((len(start), 1))
    for _ in range(16):
        moved = replace(mesh, nodes=start + share * (goal - start))
        bad = moved.scaled_jacobian() < least
        if not bad.any():
            break
        share[np.unique(mesh.elements[bad])] *= shorter
    return moved


_MEMORY = 10  # number of correction pairs of L-BFGS
_SHORTEST = 1e-10  # step length at which the line search gives up


def lbfgs(cost: Callable[[Array], tuple[float, Array]], start: Array, *, rounds: int, first_step: float) -> Array:
    """Minimise ``cost`` by at most ``rounds`` steps of L-BFGS (Nocedal & Wright, algorithm 7.5, Armijo steps).

    SciPy's implementation uses BLAS, whose threads synchronise at every dot product of this size.

    Args:
        cost: Function that returns value and gradient at a point.
        start: First point, shape (n,).
        rounds: Largest number of steps.
        first_step: Largest change of one variable in the first step.
    """
    x = start.copy()
    value, slope = cost(x)
    slope = slope.copy()
    pairs: list[tuple[Array, Array, float]] = []
    for _ in range(rounds):
        direction = -slope
        shares = []
        for s, y, rho in reversed(pairs):
            share = rho * dot(s, direction)
            direction -= share * y
            shares.append(share)
        if pairs:
            s, y, rho = pairs[-1]
            direction *= 1.0 / (rho * dot(y, y))
        else:
            direction *= first_step / max(float(np.abs(slope).max()), 1e-300)
        for (s, y, rho), share in zip(pairs, reversed(shares), strict=True):
            direction += (share - rho * dot(y, direction)) * s
        descent = dot(direction, slope)
        if not descent < 0.0:
            if not pairs:
                break
            pairs.clear()
            continue
        length = 1.0
        while True:
            there = x + length * direction
            new, new_slope = cost(there)
            if new <= value + 1e-4 * length * descent:
                break
            length *= 0.5
            if length < _SHORTEST:
                return x
        s, y = there - x, new_slope - slope
        curvature = dot(s, y)
        if curvature > 1e-10 * norm(s) * norm(y):
            pairs.append((s, y, 1.0 / curvature))
            if len(pairs) > _MEMORY:
                pairs.pop(0)
        x, value, slope = there, new, new_slope.copy()
    return x
