"""Finding hands and bodies in a joint tree: by names, and by shape where names say nothing."""

from __future__ import annotations

from warpjld.skeleton.recognise.by_name import roles_by_name
from warpjld.skeleton.recognise.by_shape import roles_by_shape
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["recognise"]


def recognise(tree: SourceTree) -> Roles:
    """Parts of a joint tree; an empty result where it is neither a hand nor a body."""
    named = roles_by_name(tree)
    if named.hands or named.body:
        return named
    return roles_by_shape(tree)
