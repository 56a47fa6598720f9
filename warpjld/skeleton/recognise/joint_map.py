"""Joint maps: user-stated pairs of canonical joint and file joint, which override names and geometry."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from warpjld.errors import InputError
from warpjld.skeleton.actor_points import POINT_JOINTS
from warpjld.skeleton.hand import HAND_PARENTS
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.suggest import did_you_mean

__all__ = ["JointMap", "check_stated", "is_canonical"]

_SIDED = ("clavicle", "shoulder", "elbow", "forearm", "hand.tip", "hip", "knee", "ankle", "ball", "toe.tip")
_TOES = tuple(f"toe{n}.{joint}" for n in range(1, 6) for joint in ("base", "knuckle2", "knuckle3", "tip"))
_TRUNK = re.compile(r"pelvis|head|head\.top|(spine|neck)[1-9]\d?")
_KNOWN = (
    "pelvis",
    "spine1",
    "neck1",
    "head",
    "head.top",
    *(f"{side}.{name}" for side in ("left", "right") for name in (*_SIDED, *_TOES, *HAND_PARENTS)),
    *HAND_PARENTS,
    *POINT_JOINTS,
)
_IGNORE = "ignore"


def is_canonical(name: str) -> bool:
    """Whether a joint map may contain this key: ``left.knee``, ``spine2``, ``right.index.base``, or ``index.base``."""
    return name in _KNOWN or _TRUNK.fullmatch(name) is not None


def check_stated(stated: Mapping[str, Any]) -> None:
    """Check a joint map independently of any file.

    Raises:
        InputError: An unknown canonical joint, or a value that is no name.
    """
    for name, value in stated.items():
        if name == _IGNORE:
            if not isinstance(value, list | tuple) or not all(isinstance(word, str) for word in value):
                raise InputError(f"joint map: ignore wants a list of the file's joints, got {value!r}")
        elif not is_canonical(name):
            raise InputError(f"joint map: no canonical joint '{name}'{did_you_mean(name, (*_KNOWN, _IGNORE))}")
        elif value is not None and not isinstance(value, str):
            raise InputError(f"joint map: {name} wants the name of a joint of the file, or null, got {value!r}")


class JointMap:
    """A joint map resolved for one file.

    Args:
        tree: The file's joints.
        stated: Canonical name → name of a joint of the file; None: the file has no such joint. The key ``ignore``
            may hold a list of the file's joints that are not to be kept as joints. ``name#2`` is the second joint of
            that name. The side of a single hand may be left out.

    Raises:
        InputError: An unknown name, or one that is given twice.
    """

    def __init__(self, tree: SourceTree, stated: Mapping[str, Any]) -> None:
        check_stated(stated)
        self._joints: dict[str, int | None] = {}
        for name, value in stated.items():
            if name == _IGNORE:
                continue
            joint = None if value is None else _find(tree, value)
            twice = next((n for n, j in self._joints.items() if joint is not None and j == joint), None)
            if twice is not None:
                raise InputError(f"joint map: '{value}' is given for both {twice} and {name}")
            self._joints[name] = joint
        self.ignored = {_find(tree, name) for name in stated.get(_IGNORE, [])}
        """Joints of the file that are not to be kept as joints."""
        both = next((n for n, j in self._joints.items() if j in self.ignored), None)
        if both is not None:
            raise InputError(f"joint map: the joint of {both} is to be ignored, too")

    @property
    def names(self) -> frozenset[str]:
        """Canonical names in the map, including those stated as missing."""
        return frozenset(self._joints)

    def apply(self, roles: Roles) -> None:
        """Set the stated joints in ``roles``, replacing what was found."""
        taken = {j for j in self._joints.values() if j is not None} | self.ignored
        for table in (roles.body, *(hand.joints for hand in roles.hands)):
            for name in [name for name, joint in table.items() if joint in taken]:
                del table[name]
        for name, joint in self._joints.items():
            table, short = _table(roles, name)
            table.pop(short, None)
            if joint is not None:
                table[short] = joint
        roles.hands[:] = [hand for hand in roles.hands if hand.joints]


def _table(roles: Roles, name: str) -> tuple[dict[str, int], str]:
    """The table of ``roles`` that holds a canonical joint, and its key there."""
    side, _, short = name.partition(".") if name.startswith(("left.", "right.")) else ("", "", name)
    if short not in HAND_PARENTS:
        return roles.body, name
    hand = next((h for h in roles.hands if h.side == side or not side), None)
    hand = hand or next((h for h in roles.hands if h.side is None), None)
    if hand is None:
        if short == "wrist" and side:
            return roles.body, name
        hand = HandRoles(side or None, {})
        wrist = roles.body.pop(f"{side}.wrist", None)
        if wrist is not None:
            hand.joints["wrist"] = wrist
        roles.hands.append(hand)
    hand.side = hand.side or side or None
    return hand.joints, short


def _find(tree: SourceTree, name: str) -> int:
    found = [j for j, own in enumerate(tree.names) if own == name]
    if not found and (numbered := re.fullmatch(r"(.+)#(\d+)", name)):
        same = [j for j, own in enumerate(tree.names) if own == numbered[1]]
        found = same[int(numbered[2]) - 1 :][:1] if int(numbered[2]) > 0 else []
    if not found:
        raise InputError(f"joint map: the file has no joint '{name}'{did_you_mean(name, tree.names)}")
    if len(found) > 1:
        raise InputError(f"joint map: {len(found)} joints of the file are called '{name}': write '{name}#1', …")
    return found[0]
