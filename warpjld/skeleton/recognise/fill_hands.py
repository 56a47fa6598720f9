"""Parts of hands that names leave out, where the tree's shape leaves no doubt: metacarpals, and all digits."""

from __future__ import annotations

from collections.abc import Collection

from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.recognise.by_shape import hands_by_shape
from warpjld.skeleton.recognise.flesh import Flesh
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["fill_hands"]


def fill_hands(tree: SourceTree, roles: Roles, flesh: Flesh, stated: Collection[str] = ()) -> None:
    """Add to ``roles`` the digits of hands of which only the wrist is named, and metacarpals with other names."""
    if tree.flat:
        return
    _digits(tree, roles, flesh)
    for hand in roles.hands:
        _metacarpals(tree, roles, hand, flesh, stated)


def _digits(tree: SourceTree, roles: Roles, flesh: Flesh) -> None:
    wrists = {joint: name for name, joint in roles.body.items() if name.endswith(".wrist")}
    if not wrists:
        return
    for hand in hands_by_shape(tree, flesh):
        name = wrists.get(hand.joints["wrist"])
        if name is not None and not set(hand.joints.values()) - {hand.joints["wrist"]} & set(roles.body.values()):
            del roles.body[name]
            side = name.partition(".")[0]
            roles.hands.append(HandRoles(side, hand.joints))
            roles.notes.append(f"{side} hand: fingers below '{tree.names[hand.joints['wrist']]}' by their shape")


def _metacarpals(tree: SourceTree, roles: Roles, hand: HandRoles, flesh: Flesh, stated: Collection[str]) -> None:
    """The joint between wrist and one finger's base that leads to nothing else."""
    taken = set(hand.joints.values()) | set(roles.body.values())
    for digit in DIGITS:
        name, base = f"{digit}.carpometacarpal", hand.joints.get(f"{digit}.base")
        if digit == "thumb" or name in hand.joints or base is None or "wrist" not in hand.joints:
            continue
        above = int(tree.parents[base])
        between = above in tree.subtree(hand.joints["wrist"]) and above not in taken
        others = [c for c in tree.children[above] if flesh.live[c] and c != base] if between else []
        helper = between and (read_name(tree.names[above]).kind == "helper" or flesh.passing[above])
        if between and not others and not helper and f"{hand.side}.{name}" not in stated:
            hand.joints[name] = above
            roles.notes.append(f"{hand.side or 'hand'}: {name} '{tree.names[above]}', between wrist and base")
