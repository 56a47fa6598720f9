"""Several actors in one file: which joints belong to the first of them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["first_actor", "in_whole_tree", "only_joints"]

_DIGITS = 3  # smallest number of joints of fingers below a wrist
_PARTS = {"wrist": "digit", "hand": "digit", "pelvis": "thigh", "hips": "thigh"}
"""Kind of joint that an actor has once (on each side) → kind of joints below it, without which it is a helper."""


def first_actor(tree: SourceTree) -> list[int] | None:
    """Joints of the first of several actors, whose names say the same twice in separate branches; None for one actor.

    Two wrists without a side in their names may be one actor's left and right.
    """
    if tree.flat:
        return None
    meanings = [read_name(name) for name in tree.names]
    found: dict[tuple[str | None, str], list[int]] = defaultdict(list)
    for joint, meaning in enumerate(meanings):
        below = _PARTS.get(meaning.kind or "")
        if below is None or (below == "digit" and meaning.side is None):
            continue
        parts = [k for k in tree.subtree(joint) if meanings[k].kind == below]
        if len(parts) >= (_DIGITS if below == "digit" else 2):
            found[meaning.side, str(meaning.kind)].append(joint)
    for joints in found.values():
        # of a wrist and a hand below it only the first counts
        apart = [j for j in joints if not set(tree.ancestors(j)) & set(joints)]
        if len(apart) > 1:
            shared = set.union(*(set(tree.ancestors(j)) for j in apart[1:]))
            own = [j for j in (apart[0], *tree.ancestors(apart[0])) if j not in shared]
            return sorted(tree.subtree(own[-1]))
    return None


def in_whole_tree(roles: Roles, joints: list[int], tree: SourceTree) -> Roles:
    """Roles that were found among ``joints`` alone, for the tree that these are part of, with a warning."""
    root = next(tree.names[j] for j in joints if int(tree.parents[j]) not in joints)
    roles.suspicious.append(
        f"several actors in one file: that of '{root}' is recognised, the others' joints keep their names; give each a "
        "file of its own"
    )
    return replace(
        roles,
        body={name: joints[j] for name, j in roles.body.items()},
        hands=[replace(h, joints={name: joints[j] for name, j in h.joints.items()}) for h in roles.hands],
        left_out=frozenset(joints[j] for j in roles.left_out),
    )


def only_joints(tree: SourceTree, joints: list[int]) -> SourceTree:
    """The tree of some of its joints, whose ancestors are left out if they are not among them."""
    number = {j: k for k, j in enumerate(joints)}
    parents = np.array([number.get(int(tree.parents[j]), -1) for j in joints], dtype=np.int64)
    return SourceTree(tuple(tree.names[j] for j in joints), parents, tree.frames[joints])
