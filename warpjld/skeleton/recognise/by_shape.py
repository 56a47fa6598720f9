"""Recognition by the tree's topology and geometry, for files whose names carry no meaning (bone_001, …)."""

from __future__ import annotations

from warpjld.skeleton.recognise.digits import Digit, assign_hands
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.prune import prune
from warpjld.skeleton.recognise.reconnect import reconnect
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.shape_body import body_by_shape
from warpjld.skeleton.recognise.shape_hand import hand_by_shape, hand_roots
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["hands_by_shape", "roles_by_shape"]


def roles_by_shape(tree: SourceTree, flesh: JointFlesh | None = None) -> Roles:
    """Hands, or a body with two hands; empty for anything else.

    Joints without skin that end no bone are left out; a flat file is first linked into chains by its bone axes.
    """
    flesh = flesh or JointFlesh(tree, None)
    small, numbers, hands = _find_hands(tree, flesh)
    if len(hands) == 2 and _have_common_ancestor(small, hands):
        roles = body_by_shape(small, [hand.joints for hand in hands])
    else:
        roles = Roles(hands=hands, how="shape")
    for hand in roles.hands:
        hand.joints = {name: numbers[j] for name, j in hand.joints.items()}
    roles.body = {name: numbers[j] for name, j in roles.body.items()}
    return roles


def hands_by_shape(tree: SourceTree, flesh: JointFlesh) -> list[HandRoles]:
    """Hands only, without sides."""
    _, numbers, hands = _find_hands(tree, flesh)
    return [HandRoles(None, {name: numbers[j] for name, j in hand.joints.items()}) for hand in hands]


def _find_hands(tree: SourceTree, flesh: JointFlesh) -> tuple[SourceTree, list[int], list[HandRoles]]:
    """The tree without dead joints, the index in ``tree`` of each of its joints, and hands in the pruned indices."""
    small, numbers = prune(tree, flesh)
    if small.flat:
        small = reconnect(small)
    found = [hand_by_shape(small, wrist) for wrist in hand_roots(small)]
    shares = JointFlesh(small, flesh.shares[numbers] if flesh.known else None)
    for hand in found:
        for digit in hand.digits.values():
            _mark_end(digit, shares)
    return small, numbers, assign_hands(small, found, shares)


def _mark_end(digit: Digit, flesh: JointFlesh) -> None:
    if flesh.known and flesh.bare[digit.joints[-1]] and len(digit.joints) > 3:
        digit.ranks[-1] = 4


def _have_common_ancestor(tree: SourceTree, hands: list[HandRoles]) -> bool:
    first, second = (set(tree.ancestors(hand.joints["wrist"])) for hand in hands)
    return bool(first & second)
