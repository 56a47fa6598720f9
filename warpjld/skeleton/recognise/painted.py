"""A file's painted skin weights, and their use to choose among joints that recognition merged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.layout import Layout
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["Painted", "prefer_skinned_joints"]

_NONE = 0.02  # share of the skin of all merged joints, up to which one of them owns no skin


@dataclass(frozen=True, eq=False)
class Painted:
    """A file's skin weights.

    Attributes:
        points: Vertices [m], shape (W, 3).
        joints: Influencing joints of the file, shape (W, K).
        weights: Their weights, rows summing to one, shape (W, K).
    """

    points: NDArray[np.float64]
    joints: NDArray[np.int64]
    weights: NDArray[np.float64]

    def amounts(self, count: int) -> NDArray[np.float64]:
        """Sum of every joint's weights, shape (N,)."""
        return np.asarray(np.bincount(self.joints.ravel(), self.weights.ravel(), minlength=count), dtype=np.float64)


def prefer_skinned_joints(layout: Layout, tree: SourceTree, painted: Painted) -> None:
    """Replace joints without skin by the joint with skin that was merged into them.

    Files have roots above the hips: joints without skin, maybe at the origin, that do not move with the body. Where
    such a one was recognised as a joint of the skeleton, its descendant that owns the skin takes its place.
    """
    amounts = painted.amounts(len(tree))
    for joint, source in enumerate(layout.sources):
        if source < 0:
            continue
        merged = np.flatnonzero(layout.owner == joint)
        if not amounts[source] <= _NONE * amounts[merged].sum():
            continue
        below = {
            a
            for k, parent in enumerate(layout.parents)
            if parent == joint and layout.sources[k] >= 0
            for a in tree.ancestors(layout.sources[k])
        }
        leading = [int(s) for s in merged if amounts[s] > 0.0 and int(s) in below and source in tree.ancestors(int(s))]
        if leading:
            lead = max(leading, key=lambda s: (amounts[s], -s))
            layout.sources[joint] = lead
            layout.positions[joint] = tree.positions[lead]
            layout.notes.append(
                f"{layout.names[joint]}: '{tree.names[source]}' carries no skin, '{tree.names[lead]}' stands for it"
            )
