"""Forces and moments on each bone of a hand: from what holds its nodes, or from what touches the skin (B eq. 8, R118).

A force on a node goes to the bones that move it. A bone's own nodes are moved by it alone; nodes where flesh was cut
off follow several bones by their weights (``Part.cut``), and hand what they bear on to them by the same weights, so the
sum over all bones is the sum of all reactions.

**Which of the two.** Reactions are exact: they are in equilibrium with contact, whatever the flesh does. They hold the
flesh of bent joints in shape, too, so those of the same pose without contact are taken off (``FleshAlone``).
Contact forces handed on by nearness (``loads_from_contact``) need no second equilibrium. They differ where they act
near a joint, whose bones share them otherwise than by nearness: ``warpjld.simulation.report.efforts`` says by how much.
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
        bones: Joint at the far end of each bone, as the skeleton numbers them.
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
    """Minus the reactions that hold bones and cut nodes: what flesh and contact put on every bone.

    Args:
        hand: The hand.
        displacement: Of all nodes [m], shape (N, 3) or longer (bodies merged after the hand).
        reactions: Forces that hold the prescribed nodes [N], of the same shape.

    Raises:
        InputError: Other shapes.
    """
    return _handed_on(hand, displacement, -reactions)


def loads_from_contact(hand: FleshHand, displacement: NDArray[np.float64], nodal: NDArray[np.float64]) -> BoneLoads:
    """Contact forces on the skin handed on to the bones by nearness: an estimate that needs no equilibrium.

    Args:
        hand: The hand.
        displacement: Of all nodes [m], shape (N, 3) or longer.
        nodal: Contact force on every node [N], of the same shape.

    Raises:
        InputError: Other shapes.
    """
    return _handed_on(hand, displacement, nodal)


def _handed_on(hand: FleshHand, displacement: NDArray[np.float64], forces: NDArray[np.float64]) -> BoneLoads:
    """Forces on nodes, each given to the bones by its node's weights."""
    count = len(hand.mesh.nodes)
    for name, array in (("displacement", displacement), ("forces", forces)):
        if array.ndim != 2 or array.shape[1] != 3 or len(array) < count:
            raise InputError(f"{name}: want shape ({count}, 3) or more rows, got {array.shape}")
    own = forces[:count]
    pushed = np.flatnonzero(own.any(axis=1))
    share = hand.weights[pushed]
    turning = np.cross(hand.mesh.nodes[pushed] + displacement[pushed], own[pushed])
    return BoneLoads(hand.flesh.bones, share.T @ own[pushed], share.T @ turning)
