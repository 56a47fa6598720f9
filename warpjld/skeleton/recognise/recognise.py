"""Finding hands and bodies in a joint tree: by names, and by shape where names say nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from warpjld.skeleton.recognise.by_name import roles_by_name
from warpjld.skeleton.recognise.by_shape import roles_by_shape
from warpjld.skeleton.recognise.joint_map import JointMap
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["recognise"]


def recognise(tree: SourceTree, stated: Mapping[str, Any] | None = None) -> Roles:
    """Parts of a joint tree; an empty result where it is neither a hand nor a body.

    Args:
        tree: The file's joints.
        stated: Canonical joints → the file's joints (see :mod:`.joint_map`), which win over what is recognised; the
            tree's shape is not asked where there are any.
    """
    roles = roles_by_name(tree)
    if not (roles.hands or roles.body or stated):
        roles = roles_by_shape(tree)
    JointMap(tree, stated or {}).apply(roles)
    return roles
