"""Body joints that names leave out, inferred from recognised limbs: pelvis, spine, feet, and ends of bones."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

import numpy as np

from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.limbs import path_below, toes_by_place
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["fill_body"]

_TOES = 3  # smallest number of chains below an ankle that are taken for toes


def fill_body(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str] = ()) -> None:
    """Add joints between and beyond limbs to ``roles``; joints ``stated`` are kept."""
    if tree.flat or not roles.body:
        return
    _fill_pelvis(tree, roles, stated)
    _fill_spine(tree, roles, stated)
    _fill_head(tree, roles, flesh, stated)
    _fill_feet(tree, roles, flesh, stated)
    _fill_ends(tree, roles, flesh, stated)


def _fill_pelvis(tree: SourceTree, roles: Roles, stated: Collection[str]) -> None:
    """Set the pelvis to the lowest common ancestor of the legs, if no joint is named so."""
    hips = [roles.body[f"{side}.hip"] for side in ("left", "right") if f"{side}.hip" in roles.body]
    if "pelvis" in roles.body or "pelvis" in stated or len(hips) < 2:
        return
    both = set(tree.ancestors(hips[1]))
    parting = next((j for j in tree.ancestors(hips[0]) if j in both), None)
    if parting is not None and parting not in roles.body.values():
        roles.body["pelvis"] = parting
        roles.notes.append(f"pelvis '{tree.names[parting]}': where the legs part")
    elif parting is not None and not stated and _trunk(tree, roles)[:1] == [parting]:
        _renumber(roles, "spine", [j for j in _trunk(tree, roles)[1:] if _part_name(roles, j) == "spine"])
        roles.body["pelvis"] = parting
        roles.notes.append(f"pelvis '{tree.names[parting]}': the spine's first joint, where the legs part")


def _fill_head(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str]) -> None:
    """Set the head to the last joint of spine or neck beyond the arms, if no joint is named so; the neck to those
    between."""
    arms = [roles.body[f"{side}.shoulder"] for side in ("left", "right") if f"{side}.shoulder" in roles.body]
    if roles.how != "names" or "head" in roles.body or stated or len(arms) < 2:
        return
    both = set(tree.ancestors(arms[1]))
    chest = next((j for j in tree.ancestors(arms[0]) if j in both), None)
    beyond = [j for j in _trunk(tree, roles) if chest in tree.ancestors(j)]
    if len(beyond) == 1 and _part_name(roles, beyond[0]) == "neck":  # a neck's only descendant with skin is the head
        above = [c for c in tree.children[beyond[-1]] if flesh.live[c] and not flesh.bare[c]]
        beyond += [c for c in above if len(above) == 1 and c not in roles.body.values()]
    if not beyond or any(b not in tree.ancestors(a) for b, a in pairwise(beyond)) or flesh.bare[beyond[-1]]:
        return
    spine = [j for j in _trunk(tree, roles) if j not in beyond and _part_name(roles, j) == "spine"]
    _renumber(roles, "spine", spine)
    _renumber(roles, "neck", beyond[:-1])
    roles.body["head"] = beyond[-1]
    roles.notes.append(f"head '{tree.names[beyond[-1]]}': the last joint of the trunk, beyond the arms")


def _trunk(tree: SourceTree, roles: Roles) -> list[int]:
    """Joints of spine and neck, from the root outwards."""
    return sorted((j for j in roles.body.values() if _part_name(roles, j) in ("spine", "neck")), key=tree.depth)


def _part_name(roles: Roles, joint: int) -> str:
    return next(name for name, j in roles.body.items() if j == joint).rstrip("0123456789")


def _renumber(roles: Roles, word: str, joints: list[int]) -> None:
    """Number a part's joints from 1; other names of these, and other joints of the part, are removed."""
    gone = [name for name, j in roles.body.items() if j in joints or name.rstrip("0123456789") == word]
    for name in gone:
        del roles.body[name]
    roles.body |= {f"{word}{n}": j for n, j in enumerate(joints, start=1)}


def _fill_spine(tree: SourceTree, roles: Roles, stated: Collection[str]) -> None:
    """Set the spine to the joints from the pelvis to the arms' common ancestor, if no joint is named so."""
    if any(name.startswith("spine") for name in (*roles.body, *stated)) or "pelvis" not in roles.body:
        return
    chest = _arms_ancestor(tree, roles)
    if chest is None or roles.body["pelvis"] not in tree.ancestors(chest):
        return
    spine = [j for j in path_below(tree, roles.body["pelvis"], chest) if j not in roles.body.values()]
    roles.body |= {f"spine{n}": j for n, j in enumerate(spine, start=1)}
    if spine:
        roles.notes.append(f"spine {', '.join(repr(tree.names[j]) for j in spine)}: between pelvis and arms")


def _arms_ancestor(tree: SourceTree, roles: Roles) -> int | None:
    arms = [roles.body[f"{side}.shoulder"] for side in ("left", "right") if f"{side}.shoulder" in roles.body]
    both = set(tree.ancestors(arms[1])) if len(arms) == 2 else set()
    return next((j for j in tree.ancestors(arms[0]) if j in both), None) if both else None


def _fill_feet(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str]) -> None:
    """Set the ball to an ankle's only child, or toes to its children, if no joint is named so."""
    ankles = {side: roles.body[f"{side}.ankle"] for side in ("left", "right") if f"{side}.ankle" in roles.body}
    middle = tree.positions[list(ankles.values())].mean(axis=0) if ankles else np.zeros(3)
    for side, ankle in ankles.items():
        known = {n for n in (*roles.body, *stated) if n.startswith((f"{side}.ball", f"{side}.toe"))}
        below = [c for c in tree.children[ankle] if flesh.live[c] and read_name(tree.names[c]).kind != "helper"]
        if known or not flesh.known or set(below) & set(roles.body.values()):
            continue
        if len(below) == 1 and not flesh.bare[below[0]]:
            roles.body[f"{side}.ball"] = below[0]
            roles.notes.append(f"{side}.ball '{tree.names[below[0]]}': the only joint below the ankle")
        elif len(below) >= _TOES and len(ankles) == 2:
            roles.body |= toes_by_place(tree, below, side, tree.positions[ankle] - middle)
            roles.notes.append(f"{side} toes: {len(below)} chains below the ankle, the innermost is the big one")


def _fill_ends(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str]) -> None:
    """Set the tips of toes, head and arms without hands to joints without skin beyond them."""
    taken = set(roles.body.values())
    for end, last in flesh.ends.items():
        name = next((name for name, j in roles.body.items() if j == last), None)
        if name is None or end in taken:
            continue
        side, _, part = name.rpartition(".")
        if part == "head" and not _continues(tree, roles.body.get("neck1", int(tree.parents[last])), last, end):
            continue  # a jaw or a brow
        tip = {"head": "head.top", "ball": f"{side}.toe.tip", "wrist": f"{side}.hand.tip"}.get(part)
        if tip and tip not in roles.body and tip not in stated:
            roles.body[tip] = end


def _continues(tree: SourceTree, above: int, last: int, end: int) -> bool:
    """Whether an end lies at least a third as far beyond a joint as that joint beyond one above it."""
    if above < 0:
        return True
    bone, beyond = tree.positions[last] - tree.positions[above], tree.positions[end] - tree.positions[last]
    return float(bone @ beyond) >= float(bone @ bone) / 3.0
