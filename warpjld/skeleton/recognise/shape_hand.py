"""Recognition of hands by the tree's shape: five chains of at least three joints below one joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.digits import Digit, HandDigits
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["hand_by_shape", "hand_roots", "leaf_chains"]

_TOE_RATIO = 0.45  # chain length per distance from the common joint: 0.25 for toes, 0.6 or more for fingers

_LONGEST = 4.0  # largest ratio of the longest finger to the shortest
_TOGETHER = 0.6  # smallest length of the mean of four fingers' unit directions
_FAR = 0.35  # distance of a chest from its pelvis, per length of a chain; smaller for fingers that share a palm joint
_DEEPEST = 0.5  # largest depth of a row of knuckles, per its width


def hand_roots(tree: SourceTree) -> list[int]:
    """Joints with the topology and proportions of a wrist."""
    return [j for j in range(len(tree)) if _is_wrist(tree, j)]


def _is_wrist(tree: SourceTree, joint: int) -> bool:
    chains = leaf_chains(tree, joint)
    if len(chains) != 5 or any(len(chain) < 3 for chain in chains):
        return False
    if any(len(leaf_chains(tree, child)) == 5 for child in tree.children[joint]):
        return False  # a descendant has all five chains, too
    at = tree.positions
    ratios = []
    for chain in chains:
        away = np.linalg.norm(at[chain[0]] - at[joint])
        ratios.append(np.linalg.norm(np.diff(at[chain], axis=0), axis=1).sum() / max(float(away), 1e-12))
    return (
        bool(np.median(ratios) > _TOE_RATIO)
        and _are_fingers([at[chain] for chain in chains])
        and not _is_trunk(tree, joint, chains)
    )


def _is_trunk(tree: SourceTree, joint: int, chains: list[list[int]]) -> bool:
    """Whether two chains leave the joint (legs at a pelvis) and two more leave one far from it (arms at a chest)."""
    at = tree.positions
    length = float(np.median([np.linalg.norm(np.diff(at[chain], axis=0), axis=1).sum() for chain in chains]))
    heads = [int(tree.parents[chain[0]]) for chain in chains]
    far = [j for j in heads if np.linalg.norm(at[j] - at[joint]) > _FAR * length]
    return heads.count(joint) >= 2 and any(far.count(j) >= 2 for j in far)


def _are_fingers(chains: list[NDArray[np.float64]]) -> bool:
    """Whether four of five chains lie side by side and point one way, unlike rays of a star or folds of a skirt.

    Their second joints are compared, since metacarpals may start at one point.
    """
    lengths = [float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum()) for chain in chains]
    if min(lengths) == 0 or max(lengths) > _LONGEST * min(lengths):
        return False
    headings = unit([chain[-1] - chain[0] for chain in chains])
    for thumb in range(5):
        fingers = [c for c in range(5) if c != thumb]
        row = np.array([chains[c][1] for c in fingers])
        wide, deep, _ = np.linalg.svd(row - row.mean(axis=0))[1]
        together = np.linalg.norm(headings[fingers].mean(axis=0))
        if together > _TOGETHER and deep < _DEEPEST * wide:
            return True
    return False


def leaf_chains(tree: SourceTree, joint: int) -> list[list[int]]:
    """For every leaf below ``joint``, the joints above it that lead to no other leaf, root side first."""
    below = tree.subtree(joint)[1:]
    chains = []
    for leaf in (j for j in below if not tree.children[j]):
        chain = [leaf]
        above = int(tree.parents[leaf])
        while above != joint and len(tree.children[above]) == 1:
            chain.append(above)
            above = int(tree.parents[above])
        chains.append(chain[::-1])
    return chains


def hand_by_shape(tree: SourceTree, wrist: int) -> HandDigits:
    """The digits of the hand below ``wrist``.

    The thumb is the digit with fewer joints than all others or, where counts are equal, the one whose direction differs
    most; the fingers are ordered from index to pinky by distance from it.
    """
    chains = leaf_chains(tree, wrist)
    at = tree.positions
    counts = sorted(len(chain) for chain in chains)
    headings = unit([at[chain[-1]] - at[chain[0]] for chain in chains])
    if counts[0] < counts[1]:
        thumb = min(range(5), key=lambda c: len(chains[c]))
    else:
        thumb = min(range(5), key=lambda c: float(headings[c] @ np.delete(headings, c, axis=0).sum(axis=0)))
    fingers = [c for c in range(5) if c != thumb]
    forward = unit(headings[fingers].mean(axis=0))
    middles = {c: at[chains[c]].mean(axis=0) for c in range(5)}
    # direction across the palm: principal axis of the fingers' centroids
    spread = np.array([middles[c] for c in fingers]) - np.mean([middles[c] for c in fingers], axis=0)
    spread -= np.outer(spread @ forward, forward)
    lateral = np.linalg.svd(spread)[2][0]
    lateral *= np.sign(lateral @ (middles[thumb] - np.mean([middles[c] for c in fingers], axis=0))) or 1.0
    fingers.sort(key=lambda c: -float(lateral @ middles[c]))
    order = zip(("thumb", "index", "middle", "ring", "pinky"), (thumb, *fingers), strict=True)
    return HandDigits(None, wrist, {digit: Digit(chains[c], [None] * len(chains[c])) for digit, c in order})
