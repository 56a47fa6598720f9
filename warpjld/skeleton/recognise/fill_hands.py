"""Hand joints that names leave out, inferred from the tree's shape: metacarpals and whole digits."""

from __future__ import annotations

from collections.abc import Collection

from warpjld.skeleton.hand import DIGITS, HAND_PARENTS
from warpjld.skeleton.recognise.by_shape import hands_by_shape
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import BY_MAP, HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["fill_hands"]


def fill_hands(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str] = ()) -> None:
    """Add digits without understood names, and metacarpals with other names, to ``roles``."""
    if tree.flat:
        return
    if not any(name.partition(".")[2] in HAND_PARENTS for name in stated):
        _fill_digits(tree, roles, flesh)
    for hand in roles.hands:
        _fill_metacarpals(tree, roles, hand, flesh, stated)


def _fill_digits(tree: SourceTree, roles: Roles, flesh: JointFlesh) -> None:
    wrists = {joint: name for name, joint in roles.body.items() if name.endswith(".wrist")}
    partial = {hand.joints["wrist"]: hand for hand in roles.hands if "wrist" in hand.joints and not _is_complete(hand)}
    if not wrists and not partial:
        return
    for hand in hands_by_shape(tree, flesh):
        if (named := partial.get(hand.joints["wrist"])) is not None and not _has_other_role(hand, named, roles):
            _complete_by_shape(tree, roles, named, hand)
            continue
        name = wrists.get(hand.joints["wrist"])
        if name is not None and not set(hand.joints.values()) - {hand.joints["wrist"]} & set(roles.body.values()):
            del roles.body[name]
            side = name.partition(".")[0]
            roles.hands.append(HandRoles(side, hand.joints))
            roles.notes.append(f"{side} hand: fingers below '{tree.names[hand.joints['wrist']]}' by their shape")


def _is_complete(hand: HandRoles) -> bool:
    return all(f"{digit}.base" in hand.joints for digit in DIGITS)


def _has_other_role(hand: HandRoles, named: HandRoles, roles: Roles) -> bool:
    """Whether a joint of a hand has another role already."""
    others = {joint for other in roles.hands if other is not named for joint in other.joints.values()}
    return bool((set(hand.joints.values()) - {hand.joints["wrist"]}) & (others | set(roles.body.values())))


def _complete_by_shape(tree: SourceTree, roles: Roles, named: HandRoles, shaped: HandRoles) -> None:
    """Take all digits by shape where names are only partly understood ("Ringfinger" beside "Daumen")."""
    understood = {name.partition(".")[0] for name in named.joints} - {"wrist"}
    moved = {
        digit
        for digit in understood
        if not {j for name, j in named.joints.items() if name.startswith(f"{digit}.")}
        & {j for name, j in shaped.joints.items() if name.startswith(f"{digit}.")}
    }
    named.joints = shaped.joints
    wrist = tree.names[shaped.joints["wrist"]]
    words = ", ".join(d for d in DIGITS if d in understood)
    who = f"{named.side or 'a'} hand"
    roles.notes.append(f"{who}: names tell {words} only; all digits below '{wrist}' by their shape")
    if moved:
        roles.suspicious.append(
            f"{who}: {', '.join(d for d in DIGITS if d in moved)} is not where its name says, going by the hand's "
            f"shape: state the joints with {BY_MAP}"
        )


def _fill_metacarpals(
    tree: SourceTree, roles: Roles, hand: HandRoles, flesh: JointFlesh, stated: Collection[str]
) -> None:
    """Set a metacarpal to the joint between wrist and a finger's base that has no other child."""
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
