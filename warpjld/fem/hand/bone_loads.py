"""Forces and moments on each bone of a hand, from reactions at its nodes or from contact forces (B eq. 8, R118).

A nodal force is distributed to the bones that move the node. A bone's own nodes are moved by it alone; nodes where
flesh was cut off follow several bones by their weights (``Part.cut``), and their forces are distributed by the same
weights, so the sum over all bones is the sum of all reactions.

Reactions are exact: they are in equilibrium with contact. They include the forces that strain the flesh of bent joints,
so those of the same pose without contact are subtracted (``FleshAlone``). Contact forces distributed by weights
(``loads_from_contact``) need no second equilibrium, but are inexact near joints: which bones bear a force there depends
on its direction (weights hand 0.0309 N of 0.0318 N to a thumb that is pressed beside its base; the first order of
elasticity, K₂₁ K₁₁⁻¹ f, agrees with the reactions to 1e-4). ``warpjld.simulation.report.efforts`` has more differences.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.flesh_hand import FleshHand

__all__ = ["BoneLoads", "loads_from_contact", "loads_from_reactions"]


@dataclass(frozen=True, eq=False)
class BoneLoads:
    """Force and moment on every bone.

    Attributes:
        bones: Distal joint of each bone, as an index of the skeleton.
        force: [N], shape (B, 3).
        moment: About the origin [N m], shape (B, 3).
    """

    bones: tuple[int, ...]
    force: NDArray[np.float64]
    moment: NDArray[np.float64]

    def __sub__(self, other: BoneLoads) -> BoneLoads:
        return BoneLoads(self.bones, self.force - other.force, self.moment - other.moment)


def loads_from_reactions(
    hand: FleshHand, displacement: NDArray[np.float64], reactions: NDArray[np.float64]
) -> BoneLoads:
    """Negative reactions at bones and cut nodes: the loads of flesh and contact on every bone.

    Args:
        hand: The hand.
        displacement: Displacement of all nodes [m], shape (N, 3) or longer (with bodies merged after the hand).
        reactions: Reactions at the prescribed nodes [N], of the same shape.

    Raises:
        InputError: Wrong shapes.
    """
    return _distributed(hand, displacement, -reactions)


def loads_from_contact(hand: FleshHand, displacement: NDArray[np.float64], nodal: NDArray[np.float64]) -> BoneLoads:
    """Contact forces distributed to the bones by weights: an estimate that needs no equilibrium.

    Args:
        hand: The hand.
        displacement: Displacement of all nodes [m], shape (N, 3) or longer.
        nodal: Contact force on every node [N], of the same shape.

    Raises:
        InputError: Wrong shapes.
    """
    return _distributed(hand, displacement, nodal)


def _distributed(hand: FleshHand, displacement: NDArray[np.float64], forces: NDArray[np.float64]) -> BoneLoads:
    """Nodal forces distributed to the bones by the nodes' weights."""
    count = len(hand.mesh.nodes)
    for name, array in (("displacement", displacement), ("forces", forces)):
        if array.ndim != 2 or array.shape[1] != 3 or len(array) < count:
            raise InputError(f"{name}: want shape ({count}, 3) or more rows, got {array.shape}")
    own = forces[:count]
    pushed = np.flatnonzero(own.any(axis=1))
    share = hand.weights[pushed]
    turning = np.cross(hand.mesh.nodes[pushed] + displacement[pushed], own[pushed])
    return BoneLoads(hand.flesh.bones, share.T @ own[pushed], share.T @ turning)
