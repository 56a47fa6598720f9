"""Grasp wrench space: the wrenches a grasp can balance with bounded normal forces; its epsilon and its volume."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.wrenches import contact_wrenches, has_full_rank

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

__all__ = ["WrenchSpace", "least_resistance", "wrench_space"]

Array = NDArray[np.float64]

# facets of a hull in six dimensions grow with the cube of its points: beyond this it takes minutes
_MOST_POINTS = 6_000
_SHAKE = 1e-9
_GROWN = 1e-12  # of the largest coordinate: what is farther beyond a facet makes the hull grow
_TOGETHER = 8  # facets that it grows at together


@dataclass(frozen=True, eq=False)
class WrenchSpace:
    """Measures of the grasp wrench space, for normal forces of at most 1 N.

    Attributes:
        epsilon: Radius of the largest ball about the origin inside it [N]: the worst wrench it resists; 0 without
            force closure.
        volume: Its six-dimensional volume [N⁶]; 0 where the wrenches span fewer dimensions.
        weakest: Unit wrench the grasp exerts with least force: the normal of the nearest facet, shape (6,); zeros
            where epsilon is 0.
        norm: How normal forces are bounded, as asked for; likewise ``torque_scale`` and ``edges``.
    """

    epsilon: float
    volume: float
    weakest: Array
    norm: str
    torque_scale: float
    edges: int


def wrench_space(
    contacts: Contacts,
    center: ArrayLike,
    *,
    torque_scale: float,
    norm: Literal["L1", "Linf"] = "L1",
    edges: int = 8,
) -> WrenchSpace:
    """Ferrari–Canny epsilon and wrench-space volume (Ferrari & Canny 1992, "Planning optimal grasps").

    With W_i the primitive wrenches of contact i at unit normal force (`contact_wrenches`; a wrench is force and
    torque/ρ, compared by the Euclidean norm), the grasp wrench space is

        L1:    conv( {0} ∪ W_1 ∪ … ∪ W_C )              the sum of the normal forces is at most 1 N,
        Linf:  conv(W_1 ∪ {0}) ⊕ … ⊕ conv(W_C ∪ {0})    each normal force is at most 1 N,

    epsilon the distance from the origin to its boundary and volume its volume (Miller & Allen 1999; Roa & Suárez 2015,
    §2.2.2). Both depend on norm, ρ, friction and edges; hence none has a hidden default but the number of edges.

    Args:
        contacts: C contacts.
        center: Point torques are taken about [m], usually the centre of mass.
        torque_scale: Length ρ that torques are divided by [m].
        norm: "L1" or "Linf" (Ferrari & Canny's two cases).
        edges: Edges of a friction cone.

    Raises:
        InputError: Another norm, or too many contacts and edges for the Minkowski sum of "Linf".
    """
    if norm not in ("L1", "Linf"):
        raise InputError(f"norm: want 'L1' or 'Linf', got {norm!r}")
    blocks = contact_wrenches(contacts, center, torque_scale, edges)
    nothing = WrenchSpace(0.0, 0.0, np.zeros(6), norm, torque_scale, edges)
    if not blocks or not has_full_rank(np.concatenate(blocks, axis=1)):
        return nothing
    points = _union(blocks) if norm == "L1" else _minkowski_sum(blocks)

    hull = _hull(points)
    nearest = int(hull.equations[:, -1].argmax())  # facets are n·w + b ≤ 0: the origin lies −b inside
    epsilon = -float(hull.equations[nearest, -1])
    volume = float(hull.volume)
    if epsilon <= 10.0 * _SHAKE:  # the origin is always a point of the set; on its boundary, nothing is resisted there
        return WrenchSpace(0.0, volume, np.zeros(6), norm, torque_scale, edges)
    return WrenchSpace(epsilon, volume, hull.equations[nearest, :-1].copy(), norm, torque_scale, edges)


def least_resistance(contacts: Contacts, center: ArrayLike, *, torque_scale: float, edges: int = 8) -> float:
    """Epsilon of ``wrench_space`` for norm "L1" alone [N], sooner: 0 without force closure.

    The hull of a few wrenches grows: where a wrench lies beyond one of its nearest facets, the farthest is added to
    it, until the nearest facet has none beyond it and so is one of the whole hull.

    Args:
        contacts: C contacts.
        center: Point torques are taken about [m].
        torque_scale: Length ρ that torques are divided by [m].
        edges: Edges of a friction cone.
    """
    blocks = contact_wrenches(contacts, center, torque_scale, edges)
    if not blocks or not has_full_rank(np.concatenate(blocks, axis=1)):
        return 0.0
    points = _union(blocks)
    beyond = _GROWN * float(np.abs(points).max())
    inside = np.zeros(len(points), dtype=bool)
    inside[0] = True
    inside[_independent(points)] = True
    epsilon = 0.0
    while True:
        equations = _hull(points[inside]).equations
        nearest = np.argsort(-equations[:, -1], kind="stable")[:_TOGETHER]
        normals, offsets = equations[nearest, :-1], equations[nearest, -1]
        heights = normals @ points.T
        farthest = heights.argmax(axis=1)
        out = heights[np.arange(len(nearest)), farthest] + offsets > beyond
        added = farthest[out & ~inside[farthest]]
        if not out[0] or not len(added):
            epsilon = -float(offsets[0])
            break
        inside[added] = True
    return epsilon if epsilon > 10.0 * _SHAKE else 0.0


def _independent(points: Array) -> NDArray[np.integer]:
    """Six of points (k, 6) that span all dimensions, so that a hull of them and the origin is not flat."""
    from scipy.linalg import qr

    return np.asarray(qr(points.T, mode="r", pivoting=True)[1][:6])


def _hull(points: Array) -> ConvexHull:
    """Convex hull; points so regular that qhull cannot order its facets are shaken by 1e-9 of their size."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError:
        shaken = np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
        return ConvexHull(points + _SHAKE * np.abs(points).max() * shaken)


def _union(blocks: list[Array]) -> Array:
    return np.concatenate([np.zeros((1, 6)), *(block.T for block in blocks)])


def _minkowski_sum(blocks: list[Array]) -> Array:
    counts = [block.shape[1] + 1 for block in blocks]
    if prod(counts) > _MOST_POINTS:
        raise InputError(
            f"norm 'Linf': {len(blocks)} contacts with {max(counts) - 1} edges make {prod(counts)} sums, at most "
            f"{_MOST_POINTS}; take fewer edges or contacts, or norm 'L1'"
        )
    total = np.zeros((1, 6))
    for block in blocks:
        corners = np.concatenate([np.zeros((1, 6)), block.T])
        total = (total[:, None, :] + corners[None, :, :]).reshape(-1, 6)
    return total
