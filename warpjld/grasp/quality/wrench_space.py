"""Grasp wrench space: the wrenches that bounded normal forces can exert; its epsilon and volume (Ferrari & Canny)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.nearest_facet import distances_to_boundary, hull_measures
from warpjld.grasp.quality.wrenches import contact_wrenches, has_full_rank

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

__all__ = ["WrenchSpace", "least_resistance", "least_resistances", "wrench_space"]

Array = NDArray[np.float64]

# the number of facets of a hull in six dimensions grows with the cube of its points: more points take minutes
_MOST_POINTS = 6_000
_SHAKE = 1e-9  # relative size of the perturbation of degenerate points
_GROWN = 1e-12  # distance beyond a facet, relative to the largest coordinate, from which a point is added to the hull
_TOGETHER = 8  # facets that are tested per step


@dataclass(frozen=True, eq=False)
class WrenchSpace:
    """Measures of the grasp wrench space, for normal forces of at most 1 N.

    Attributes:
        epsilon: Radius of the largest ball about the origin inside it [N]: the magnitude of the smallest wrench that
            can break the grasp; 0 without force closure.
        volume: Its six-dimensional volume [N⁶]; 0 where the wrenches span fewer dimensions.
        weakest: Unit wrench in the direction in which the grasp is weakest: the normal of the nearest facet, shape
            (6,); zeros where epsilon is 0.
        norm: How normal forces are bounded, as given; likewise ``torque_scale`` and ``edges``.
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
    §2.2.2). Both depend on norm, ρ, friction and edges, which are therefore part of the result.

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

    volume, epsilon, weakest = hull_measures(points) or _by_qhull(points)
    if epsilon <= 10.0 * _SHAKE:  # the origin, always a point of the set, is on its boundary
        return WrenchSpace(0.0, volume, np.zeros(6), norm, torque_scale, edges)
    return WrenchSpace(epsilon, volume, weakest, norm, torque_scale, edges)


def least_resistance(contacts: Contacts, center: ArrayLike, *, torque_scale: float, edges: int = 8) -> float:
    """Epsilon [N] of ``wrench_space`` for norm "L1", without the volume and therefore faster; 0 without force closure.

    Args:
        contacts: C contacts.
        center: Point torques are taken about [m].
        torque_scale: Length ρ that torques are divided by [m].
        edges: Edges of a friction cone.
    """
    return least_resistances([contacts], center, torque_scale=torque_scale, edges=edges)[0]


def least_resistances(
    grasps: Sequence[Contacts],
    center: ArrayLike,
    *,
    torque_scale: float,
    edges: int = 8,
    shares: Sequence[Array] | None = None,
) -> list[float]:
    """``least_resistance`` of many grasps of one object [N]; ``shares`` are the normal forces of each grasp's contacts
    (C,) at which each takes 1 N of the sum [N], by default 1 N."""
    blocks = [contact_wrenches(contacts, center, torque_scale, edges) for contacts in grasps]
    if shares is not None:
        blocks = [
            [size * block for size, block in zip(*both, strict=True)] for both in zip(shares, blocks, strict=True)
        ]
    spanning = [k for k, own in enumerate(blocks) if own and has_full_rank(np.concatenate(own, axis=1))]
    points = [_union(blocks[k]) for k in spanning]
    out = [0.0] * len(grasps)
    for k, own, found in zip(spanning, points, distances_to_boundary(points), strict=True):
        epsilon = _by_growing_hull(own) if found is None else found
        out[k] = epsilon if epsilon > 10.0 * _SHAKE else 0.0
    return out


def _by_qhull(points: Array) -> tuple[float, float, Array]:
    """Volume of the hull of points (k, 6), distance from the origin to its boundary and normal there (6,)."""
    hull = _hull(points)
    nearest = int(hull.equations[:, -1].argmax())  # facets are n·w + b ≤ 0: the origin lies −b inside
    return float(hull.volume), -float(hull.equations[nearest, -1]), hull.equations[nearest, :-1].copy()


def _by_growing_hull(points: Array) -> float:
    """Distance from the origin to the boundary of the hull of points (k, 6) by qhull.

    Starting from a few points, the farthest point beyond each of the nearest facets is added, until none lies beyond
    the nearest facet, which is then a facet of the full hull.
    """
    beyond = _GROWN * float(np.abs(points).max())
    inside = np.zeros(len(points), dtype=bool)
    inside[0] = True
    inside[_independent(points)] = True
    while True:
        equations = _hull(points[inside]).equations
        nearest = np.argsort(-equations[:, -1], kind="stable")[:_TOGETHER]
        normals, offsets = equations[nearest, :-1], equations[nearest, -1]
        heights = normals @ points.T
        farthest = heights.argmax(axis=1)
        out = heights[np.arange(len(nearest)), farthest] + offsets > beyond
        added = farthest[out & ~inside[farthest]]
        if not out[0] or not len(added):
            return -float(offsets[0])
        inside[added] = True


def _independent(points: Array) -> NDArray[np.integer]:
    """Indices of six linearly independent points of (k, 6); with the origin they form a hull that is not flat."""
    from scipy.linalg import qr

    return np.asarray(qr(points.T, mode="r", pivoting=True)[1][:6])


def _hull(points: Array) -> ConvexHull:
    """Convex hull; points on which qhull fails because of symmetry are perturbed by 1e-9 of their size."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError:
        shaken = np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
        return ConvexHull(points + _SHAKE * np.abs(points).max() * shaken)


def _union(blocks: list[Array]) -> Array:
    """The origin and all primitive wrenches, shape (k, 6)."""
    return np.concatenate([np.zeros((1, 6)), *(block.T for block in blocks)])


def _minkowski_sum(blocks: list[Array]) -> Array:
    """Sums of one point of {0} ∪ W_i for every contact i, shape (k, 6).

    Raises:
        InputError: More than ``_MOST_POINTS`` sums.
    """
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
