"""Removal of joints without skin from a joint tree, before recognition by shape."""

from __future__ import annotations

import numpy as np

from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.kept import lies_on_bone
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["prune"]


def prune(tree: SourceTree, flesh: JointFlesh) -> tuple[SourceTree, list[int]]:
    """The tree without dead joints, twist joints, and joints on the line between two others.

    Returns:
        The smaller tree, and for each of its joints its index in ``tree``.
    """
    gone = flesh.dead.copy()
    if flesh.known:
        for j in range(len(tree)):
            gone[j] |= lies_on_bone(tree, j) or bool(flesh.passing[j] and flesh.on_the_way(j))
    kept = [int(j) for j in np.flatnonzero(~gone)]
    if len(kept) == len(tree):
        return tree, kept
    number = {j: i for i, j in enumerate(kept)}
    parents = [next((number[a] for a in tree.ancestors(j) if a in number), -1) for j in kept]
    return SourceTree(tuple(tree.names[j] for j in kept), np.array(parents), tree.frames[kept]), kept
