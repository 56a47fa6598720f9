"""What flesh does to each bone: from the reactions that hold it, or from what touches the skin (B eq. 8, R118)."""

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
    """Minus the reactions on each bone's nodes: what its muscles have to balance.

    They hold the flesh of flexed joints in shape, too. Where that matters, subtract the loads of the same pose without
    contact.

    Args:
        hand: The hand.
        displacement: Of all nodes [m], shape (N, 3) or longer (bodies merged after the hand).
        reactions: Forces that hold the prescribed nodes [N], of the same shape.
    """
    _check(hand, displacement, reactions)
    force, moment = [], []
    for nodes in hand.bone_nodes:
        pushes = -reactions[nodes]
        force.append(pushes.sum(axis=0))
        moment.append(np.cross(hand.mesh.nodes[nodes] + displacement[nodes], pushes).sum(axis=0))
    return BoneLoads(hand.flesh.bones, np.array(force), np.array(moment))


def loads_from_contact(hand: FleshHand, displacement: NDArray[np.float64], nodal: NDArray[np.float64]) -> BoneLoads:
    """Contact forces on the skin handed on to the bones, each force to the bones that carry its node.

    Flesh in equilibrium hands all of a force on. The weights say to which bones it goes, by nearness: contact alone is
    counted, not the flesh that is stretched in flexed joints.

    Args:
        hand: The hand.
        displacement: Of all nodes [m], shape (N, 3) or longer.
        nodal: Contact force on every node [N], of the same shape.
    """
    _check(hand, displacement, nodal)
    own = nodal[: len(hand.mesh.nodes)]
    pushed = np.flatnonzero(own.any(axis=1))
    share = hand.weights[pushed]
    turning = np.cross(hand.mesh.nodes[pushed] + displacement[pushed], own[pushed])
    return BoneLoads(hand.flesh.bones, share.T @ own[pushed], share.T @ turning)


def _check(hand: FleshHand, displacement: NDArray[np.float64], forces: NDArray[np.float64]) -> None:
    count = len(hand.mesh.nodes)
    for name, array in (("displacement", displacement), ("forces", forces)):
        if array.ndim != 2 or array.shape[1] != 3 or len(array) < count:
            raise InputError(f"{name}: want shape ({count}, 3) or more rows, got {array.shape}")
