"""Recognition by the tree's shape, for files whose names say nothing (bone_001, …)."""

from __future__ import annotations

from warpjld.skeleton.recognise.reconnect import reconnect
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.shape_body import body_by_shape
from warpjld.skeleton.recognise.shape_hand import hand_by_shape, hand_roots
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["roles_by_shape"]


def roles_by_shape(tree: SourceTree) -> Roles:
    """Hands, or a body with two; empty for anything else. A flat file is first chained by its bone axes."""
    if tree.flat:
        tree = reconnect(tree)
    hands = [hand_by_shape(tree, wrist) for wrist in hand_roots(tree)]
    if len(hands) == 2 and set(tree.ancestors(hands[0]["wrist"])) & set(tree.ancestors(hands[1]["wrist"])):
        return body_by_shape(tree, hands)
    return Roles(hands=[HandRoles(None, hand) for hand in hands], how="shape")
