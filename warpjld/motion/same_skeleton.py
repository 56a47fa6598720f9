"""Matching of an animation's joints with a rig's own: by names, and by place in the tree for duplicate names."""

from __future__ import annotations

import re
from collections import Counter
from itertools import product

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.scales import polar
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["match_joints", "same_bones", "same_rest"]

_SAME = 1e-4
"""Largest difference of rest transforms of one skeleton, per size of the skeleton."""
_SAME_BONE = 1e-2
"""Largest difference of joint offsets in their parents' frames, per longest offset; for other exporters or rest
poses."""


def match_joints(theirs: SourceTree, own: SourceTree) -> NDArray[np.int64]:
    """Joint of ``theirs`` for each of ``own``, -1 where there is none, shape (N,).

    Names are compared exactly, and without case, namespace and punctuation, which exporters change; the comparison that
    matches more joints is used. Duplicate names are distinguished by place in the tree and order of siblings.
    """
    if theirs.names == own.names and np.array_equal(theirs.parents, own.parents):
        return np.arange(len(own))
    ways = (
        _match([plain(n) for n in theirs.names], [plain(n) for n in own.names], theirs, own) for plain in (str, _plain)
    )
    return max(ways, key=lambda found: int((found >= 0).sum()))  # the first, exact names, if equal


def _match(their_names: list[str], own_names: list[str], theirs: SourceTree, own: SourceTree) -> NDArray[np.int64]:
    count, their_count = Counter(own_names), Counter(their_names)
    out = np.array([their_names.index(n) if count[n] == 1 == their_count[n] else -1 for n in own_names])
    if (out >= 0).all() or not any(their_count[n] for n in own_names):
        return out
    below: list[list[int]] = [[] for _ in range(len(theirs) + 1)]  # children by node; the last entry holds the roots
    for k, parent in enumerate(theirs.parents):
        below[parent].append(k)

    def children(node: int) -> dict[str, list[int]]:
        """Nearest descendants of a node of ``theirs`` with a name that the rig has, by name."""
        found: dict[str, list[int]] = {}
        todo = list(below[node])
        while todo:
            k = todo.pop(0)
            if their_names[k] in count:
                found.setdefault(their_names[k], []).append(k)
            else:
                todo = below[k] + todo
        return found

    roots = [j for j, parent in enumerate(own.parents) if parent < 0]
    best: dict[int, int] = {}
    for start in (-1, *range(len(theirs))):  # candidate parents of the rig's roots
        pairs: dict[int, int] = {}
        todo = [(roots, start)]
        while todo:
            siblings, node = todo.pop()
            there = children(node)
            taken: Counter[str] = Counter()
            for j in siblings:
                name = own_names[j]
                if taken[name] < len(there.get(name, [])):
                    pairs[j] = there[name][taken[name]]
                    todo.append((list(own.children[j]), pairs[j]))
                taken[name] += 1
        if len(pairs) > len(best):
            best = pairs
    used = set(out.tolist())
    for j, k in best.items():
        if out[j] < 0 and k not in used:
            out[j] = k
    return out


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", re.split(r"[:|/]", name)[-1].lower()).removeprefix("mixamorig")


def same_rest(
    theirs: NDArray[np.float64], own: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Maps between rest transforms of matched joints (K, 4, 4) and those of a rig; None if they do not fit.

    Returns:
        Maps (4, 4) of the world and of joint frames with ``world @ theirs @ frame`` = ``own``. Some exporters scale
        joint positions, others the node above, which scales joint frames, too; so the second map is a scale.
    """
    middle = [frames[:, :3, 3] - frames[:, :3, 3].mean(axis=0) for frames in (theirs, own)]
    spread = [float(np.linalg.norm(places)) for places in middle]
    sizes = np.abs(np.linalg.det(own[:, :3, :3]))
    reference = int(np.argmax(sizes > 1e-3 * sizes.max()))  # the first with a non-singular frame
    linear = own[reference, :3, :3] @ np.linalg.inv(theirs[reference, :3, :3])
    factor = float(np.abs(np.linalg.det(linear)) ** (1.0 / 3.0))
    scale = spread[1] / spread[0] if len(own) > 1 and min(spread) > 0.0 else factor
    world, frame = np.eye(4), np.eye(4)
    world[:3, :3] = scale / factor * linear
    world[:3, 3] = own[reference, :3, 3] - world[:3, :3] @ theirs[reference, :3, 3]
    frame[:3, :3] *= factor / scale
    off = np.abs(world @ theirs @ frame - own)
    size = float(np.linalg.norm(np.ptp(own[:, :3, 3], axis=0))) or 1.0
    near = off[:, :3, 3].max() <= _SAME * size and off[:, :3, :3].max() <= 10 * _SAME * np.abs(own[:, :3, :3]).max()
    return (world, frame) if near else None


def same_bones(
    theirs: NDArray[np.float64], own: NDArray[np.float64], parents: NDArray[np.int64]
) -> tuple[NDArray[np.float64], float] | None:
    """Whether matched joints have the same bones, in another rest pose.

    Args:
        theirs: Rest transforms in the animation's file, shape (K, 4, 4).
        own: Rest transforms of the rig, shape (K, 4, 4).
        parents: Parent of each joint, -1 for the root, shape (K,).

    Returns:
        The map of their world to the rig's, (4, 4), a scale and possibly a quarter turn (files of one skeleton differ
        in their up axis only), and the factor for lengths in joint frames. None if the bones differ.
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
