"""Recognition of hands and bodies in a joint tree: by names, else by shape; checked by geometry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.actors import first_actor, in_whole_tree, only_joints
from warpjld.skeleton.recognise.by_name import roles_by_name
from warpjld.skeleton.recognise.by_shape import roles_by_shape
from warpjld.skeleton.recognise.check_hands import check_hands
from warpjld.skeleton.recognise.check_limbs import check_limbs
from warpjld.skeleton.recognise.evidence import reject_unfounded
from warpjld.skeleton.recognise.fill_body import fill_body
from warpjld.skeleton.recognise.fill_hands import fill_hands
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.joint_map import JointMap
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["recognise"]


def recognise(
    tree: SourceTree,
    shares: NDArray[np.float64] | None = None,
    stated: Mapping[str, Any] | None = None,
    *,
    by_shape: bool = True,
) -> Roles:
    """Roles of a joint tree's joints; empty where it is neither a hand nor a body.

    Roles are proposed by names, or by the tree's shape if no name is understood, and checked against lengths, symmetry
    and the skin that each joint owns. Conflicts are resolved by geometry, with a note, or reported in
    ``Roles.suspicious``.

    Args:
        tree: The file's joints.
        shares: Share of the surface that each joint moves, shape (N,), as from
            :func:`~warpjld.skeleton.recognise.flesh.flesh_shares`; None without painted weights.
        stated: Canonical joints → the file's joints, stated by the user (see :mod:`.joint_map`); overrides all else.
        by_shape: Whether to fall back to the tree's shape; not where a file's own table states the joints, and hair
            would only be taken for limbs.

    Raises:
        InputError: ``stated`` names joints that the file does not have.
    """
    joints = None if stated else first_actor(tree)
    if joints is not None:
        own = recognise(only_joints(tree, joints), None if shares is None else shares[joints], by_shape=by_shape)
        return in_whole_tree(own, joints, tree)
    flesh = JointFlesh(tree, shares)
    by_hand = JointMap(tree, stated or {})
    roles = roles_by_name(tree, flesh)
    if by_shape and not (roles.hands or roles.body):
        roles = roles_by_shape(tree, flesh)
    roles = _checked(tree, roles, flesh, by_hand)
    if by_shape and roles.how == "names" and not (roles.hands or roles.body):
        shaped = _checked(tree, roles_by_shape(tree, flesh), flesh, by_hand)
        if shaped.hands or shaped.body:
            roles = shaped
    check_hands(tree, roles)
    roles.left_out = frozenset(by_hand.ignored)
    return roles


def _checked(tree: SourceTree, roles: Roles, flesh: JointFlesh, by_hand: JointMap) -> Roles:
    """Proposed roles merged with the stated ones, completed, and checked by geometry."""
    by_hand.apply(roles)
    fill_hands(tree, roles, flesh, by_hand.names)
    check_limbs(tree, roles, flesh, by_hand.names)
    fill_body(tree, roles, flesh, by_hand.names)
    reject_unfounded(tree, roles, by_hand.names)
    by_hand.apply(roles)
    return roles
