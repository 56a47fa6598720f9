"""Finding hands and bodies in a joint tree: by names, and by shape where names say nothing; checked by geometry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    """Parts of a joint tree; an empty result where it is neither a hand nor a body.

    Names propose, or the tree's shape where they say nothing; lengths, symmetry and the skin each joint owns must
    agree. What does not is settled by geometry, with a note, or told in ``Roles.suspicious``.

    Args:
        tree: The file's joints.
        shares: Share of the surface that each joint moves, shape (N,), as from
            :func:`~warpjld.skeleton.recognise.flesh.flesh_shares`; None where no skin tells.
        stated: Canonical joints → the file's joints, stated by hand (see :mod:`.joint_map`): wins over everything.
        by_shape: Whether the tree's shape is asked where names say nothing: not where a file's own table states what
            is what, and hair would only be taken for limbs.

    Raises:
        InputError: ``stated`` names joints that are not there.
    """
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
    """What names or shape propose, with what is stated, as far as geometry agrees."""
    by_hand.apply(roles)
    fill_hands(tree, roles, flesh, by_hand.names)
    check_limbs(tree, roles, flesh, by_hand.names)
    fill_body(tree, roles, flesh, by_hand.names)
    reject_unfounded(tree, roles, by_hand.names)
    by_hand.apply(roles)
    return roles
