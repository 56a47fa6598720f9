"""Reconstruction of a hierarchy for flat files: bones point at the next joint along a common axis of their frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.bones import bone_directions
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["reconnect"]

_ALIGNED = 0.98  # smallest cosine between a bone and the direction to the next joint


def reconnect(tree: SourceTree) -> SourceTree:
    """Link the joints of one flat hand by their bone axes; the tree itself where frames are not conclusive.

    Every joint's bone points at the next joint of its digit, along the same axis of all frames. The chain head that is
    furthest from the ends of the digits is the wrist, the parent of all chains.
    """
    ways = [_followers(tree, sign * axis) for axis in np.eye(3) for sign in (1.0, -1.0)]
    # straight fingers can be followed in both directions: outwards they spread
    ways = [way for way in ways if _spread(tree, _ends(way)) > _spread(tree, _heads(way))]
    best = max(ways, key=_count_links, default=[])
    if _count_links(best) < 0.6 * len(tree):
        return tree
    ends, heads = _ends(best), _heads(best)
    middle = tree.positions[ends].mean(axis=0)
    wrist = max(heads, key=lambda j: float(np.linalg.norm(tree.positions[j] - middle)))
    parents = np.full(len(tree), wrist)
    parents[wrist] = -1
    for joint, after in enumerate(best):
        if after >= 0 and joint != wrist and after != wrist:
            parents[after] = joint
    return replace(tree, parents=parents)


def _followers(tree: SourceTree, axis: NDArray[np.float64]) -> list[int]:
    """Index of the joint that each bone points at, -1 for none; each is followed by its nearest predecessor only."""
    directions = bone_directions(tree, axis)
    away = tree.positions[None] - tree.positions[:, None]
    distance = np.linalg.norm(away, axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        aligned = np.einsum("ijk,ik->ij", away, directions) / distance > _ALIGNED
    reach = np.where(aligned & (distance > 0), distance, np.inf)
    after = np.where(np.isfinite(reach).any(axis=1), reach.argmin(axis=1), -1)
    for joint in set(after.tolist()) - {-1}:
        rivals = np.flatnonzero(after == joint)
        after[rivals[rivals != rivals[reach[rivals, joint].argmin()]]] = -1
    return [int(j) for j in after]


def _ends(after: list[int]) -> list[int]:
    return [j for j, following in enumerate(after) if following < 0]


def _heads(after: list[int]) -> list[int]:
    return [j for j in range(len(after)) if j not in after]


def _spread(tree: SourceTree, joints: list[int]) -> float:
    return float(np.linalg.norm(tree.positions[joints].std(axis=0))) if joints else 0.0


def _count_links(after: list[int]) -> int:
    return sum(j >= 0 for j in after)
