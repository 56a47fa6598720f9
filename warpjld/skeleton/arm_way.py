"""The way of an arm around its body from one posture to another.

A motion between two postures that both clear the body may pass through it. The way is planned on a probabilistic
roadmap (Kavraki et al., IEEE Trans. Robotics and Automation 12, 1996): postures of a low-discrepancy sample of the
arm's range that clear the body are joined to their nearest neighbours by straight ways in the space of angles; each
costs its length and, far more, its penetration, and the cheapest way from end to end is taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.arm import Arm
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.reach import Depths

__all__ = ["way_between"]

_SAMPLES = 1024  # postures that are tried
_CLEAR = 192  # of those that clear the body, as many by which the ways are shortest are on the roadmap
_NEIGHBOURS = 10  # to which each is joined
_STEPS = 6  # postures on a way between two neighbours that are looked at
_PENETRATION = 0.004
"""Root of the mean square of penetration along a way, per length of the arm, that weighs as much as a way twice as
long: any clear way is preferred."""


def way_between(
    arm: Arm,
    angles: NDArray[np.float64],
    body: Poses,
    first: NDArray[np.float64],
    last: NDArray[np.float64],
    depths: Depths,
) -> list[NDArray[np.float64]]:
    """Postures from one to another by which an arm goes around its body, without these two.

    Args:
        arm: The arm.
        angles: The skeleton's angles; those of other joints are kept [rad], shape (J, 4).
        body: A single pose that places the body.
        first: Angles of the arm at the beginning of its way [rad], shape (n,).
        last: Likewise at its end.
        depths: Penetration depths of samples along the arm in what it must not enter.

    Returns:
        Angles of the arm [rad], shape (n,); none where the straight way is the cheapest.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree
    from scipy.stats import qmc

    low, high = arm.limits.T
    between = low + qmc.Sobol(len(low), scramble=False).random(_SAMPLES) * (high - low)
    # a half of them nearer to the straight way, as the sample is sparse
    between[::2] = 0.5 * (between[::2] + first + np.linspace(0.0, 1.0, len(between[::2]))[:, None] * (last - first))
    between = between[_penetration(arm, angles, body, between[:, None], depths) == 0.0]
    length = np.linalg.norm(between - first, axis=1) + np.linalg.norm(last - between, axis=1)
    nodes = np.concatenate([[first, last], between[np.argsort(length, kind="stable")[:_CLEAR]]])
    near = cKDTree(nodes).query(nodes, min(_NEIGHBOURS + 1, len(nodes)))[1]
    edges = np.stack([np.repeat(np.arange(len(nodes)), near.shape[1]), near.ravel()], axis=1)
    edges = np.unique(np.sort(np.concatenate([edges, [[0, 1]]]), axis=1), axis=0)
    edges = edges[edges[:, 0] < edges[:, 1]]
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    share = np.linspace(0.0, 1.0, _STEPS + 2)[1:-1, None]
    entered = _penetration(arm, angles, body, a[:, None] + share * (b - a)[:, None], depths)
    costs = np.linalg.norm(b - a, axis=1) * (1.0 + entered / (_PENETRATION * arm.length))
    graph = csr_array((costs, (edges[:, 0], edges[:, 1])), shape=(len(nodes), len(nodes)))
    before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)[1]
    way, node = [last], int(before[1])
    while node > 0:
        way.append(nodes[node])
        node = int(before[node])
    return _shortened(arm, angles, body, [first, *way[::-1]], depths)


def _shortened(
    arm: Arm, angles: NDArray[np.float64], body: Poses, way: list[NDArray[np.float64]], depths: Depths
) -> list[NDArray[np.float64]]:
    """The postures between the ends of a way that cannot be left out: from each, the farthest is next that a clear
    straight way leads to."""
    share = np.linspace(0.0, 1.0, 3 * _STEPS)[:, None]
    out, k = [], 0
    while k < len(way) - 2:
        ahead = np.array(way[k + 1 :])
        entered = _penetration(arm, angles, body, way[k] + share * (ahead - way[k])[:, None], depths)
        k += 1 + max(np.flatnonzero(entered == 0.0).tolist(), default=0)
        if k < len(way) - 1:
            out.append(way[k])
    return out


def _penetration(
    arm: Arm, angles: NDArray[np.float64], body: Poses, ways: NDArray[np.float64], depths: Depths
) -> NDArray[np.float64]:
    """Root of the mean square, over the postures of each way (B, S, n), of the sum of penetration depths [m], (B,)."""
    count, steps, free = ways.shape
    positions, rotations = arm.chains(angles, ways.reshape(-1, free), body)
    summed = depths(positions, rotations).sum(axis=1).reshape(count, steps)
    return np.asarray(np.sqrt((summed**2).mean(axis=1)))
