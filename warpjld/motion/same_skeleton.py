"""Which joints of an animation's file are a rig's own: by names, by place in the tree where names are doubled."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from warpjld.scales import polar
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["match_joints", "same_bones", "same_rest"]

_SAME = 1e-4
"""Rest transforms that differ by less, relative to the skeleton's size, are those of one skeleton."""
_SAME_BONE = 1e-2
"""Likewise offsets of joints in their parents' frames, relative to the longest: other exporters, other rest poses."""


def match_joints(theirs: SourceTree, own: SourceTree) -> NDArray[np.int64]:
    """Joint of ``theirs`` for each of ``own``, -1 where there is none, shape (N,).

    Names are compared as they are; where no joint is found so, without case, name space and punctuation, which
    exporters change. Doubled names are told apart by the names above them and by the order of siblings.
    """
    if theirs.names == own.names and np.array_equal(theirs.parents, own.parents):
        return np.arange(len(own))
    found = _match(theirs, own, str)
    return found if (found >= 0).any() else _match(theirs, own, _plain)


def _match(theirs: SourceTree, own: SourceTree, key: Callable[[str], str]) -> NDArray[np.int64]:
    names = [key(name) for name in theirs.names]
    paths = [_path(theirs, j, key) for j in range(len(theirs))]
    out = np.full(len(own), -1)
    for j, name in enumerate(own.names):
        called = [k for k, other in enumerate(names) if other == key(name)]
        if len(called) > 1:
            called = _longest_match(_path(own, j, key), called, paths)
        if len(called) == 1:
            out[j] = called[0]
    used, counts = np.unique(out[out >= 0], return_counts=True)
    out[np.isin(out, used[counts > 1])] = -1
    return out


def _path(tree: SourceTree, joint: int, key: Callable[[str], str]) -> list[tuple[str, int]]:
    """A joint and those above it: name, and number among its siblings of that name."""
    out = []
    for j in (joint, *tree.ancestors(joint)):
        siblings = [k for k in range(len(tree)) if tree.parents[k] == tree.parents[j]]
        alike = [k for k in siblings if key(tree.names[k]) == key(tree.names[j])]
        out.append((key(tree.names[j]), alike.index(j)))
    return out


def _longest_match(
    path: Sequence[tuple[str, int]], candidates: list[int], paths: Sequence[Sequence[tuple[str, int]]]
) -> list[int]:
    """The candidates whose path is this one; nodes above the root of either do not count."""

    def common(other: Sequence[tuple[str, int]]) -> int:
        parted = (n for n, (a, b) in enumerate(zip(path, other, strict=False)) if a != b)
        return next(parted, min(len(path), len(other)))

    lengths = [common(paths[k]) for k in candidates]
    best = [k for k, length in zip(candidates, lengths, strict=True) if length == max(lengths)]
    # of a chain of one name several may reach as far: the one at the same depth below where they part
    whole = [k for k in best if len(paths[k]) == len(path)]
    return whole if len(best) > 1 and whole else best


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", re.split(r"[:|/]", name)[-1].lower()).removeprefix("mixamorig")


def same_rest(theirs: NDArray[np.float64], own: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """What brings rest transforms of matched joints (K, 4, 4) on those of a rig, (4, 4); None where nothing does."""
    reference = int(np.argmax(np.linalg.norm(own[:, :3, :3], axis=(1, 2)) > 1e-3 * np.abs(own[:, :3, :3]).max()))
    placing = own[reference] @ np.linalg.inv(theirs[reference])
    off = np.abs(placing @ theirs - own)
    size = float(np.linalg.norm(np.ptp(own[:, :3, 3], axis=0))) or 1.0
    near = off[:, :3, 3].max() <= _SAME * size and off[:, :3, :3].max() <= 10 * _SAME * np.abs(own[:, :3, :3]).max()
    return placing if near else None


def same_bones(
    theirs: NDArray[np.float64], own: NDArray[np.float64], parents: NDArray[np.int64]
) -> tuple[NDArray[np.float64], float] | None:
    """Whether matched joints are the same bones in another rest pose.

    Args:
        theirs: Rest transforms in the animation's file, shape (K, 4, 4).
        own: Those of the rig.
        parents: Parent of each, -1 for the root, shape (K,).

    Returns:
        What brings their world on the rig's, (4, 4): a scale and a quarter turn or none, since another up axis is the
        only thing that files of one skeleton disagree in; and by how much lengths in joint frames are multiplied. None
        where bones differ.
    """
    below = np.flatnonzero(parents >= 0)
    if len(below) < 3 or (parents < 0).sum() != 1:
        return None
    offsets = [(np.linalg.inv(f[parents[below]]) @ f[below])[:, :3, 3] for f in (theirs, own)]
    lengths = [np.linalg.norm(offset, axis=1) for offset in offsets]
    long = lengths[1] > 0.05 * lengths[1].max()
    if not (long.sum() >= 3 and (lengths[0][long] > 0.0).all()):
        return None
    factor = float(np.median(lengths[1][long] / lengths[0][long]))
    if np.linalg.norm(factor * offsets[0] - offsets[1], axis=1).max() > _SAME_BONE * lengths[1].max():
        return None
    root = int(np.flatnonzero(parents < 0)[0])
    turn, _ = polar(own[root, :3, :3] @ np.linalg.inv(theirs[root, :3, :3]))
    bones = [np.linalg.norm(f[below, :3, 3] - f[parents[below], :3, 3], axis=1) for f in (theirs, own)]
    placing = np.eye(4)
    placing[:3, :3] = np.median(bones[1][long] / bones[0][long]) * max(_quarter_turns(), key=lambda q: (q * turn).sum())
    return placing, factor


def _quarter_turns() -> list[NDArray[np.float64]]:
    """The 24 rotations of a cube."""
    turns = []
    for order in ([0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.eye(3)[order] * signs
            if np.linalg.det(matrix) > 0.0:
                turns.append(matrix)
    return turns
