"""Check of recognised hands: digits that differ between left and right."""

from __future__ import annotations

import numpy as np

from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.roles import BY_MAP, HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["check_hands"]

_UNEQUAL = 1.5  # suspicious ratio of a bone's length on both sides, relative to the digit's median ratio


def check_hands(tree: SourceTree, roles: Roles) -> None:
    """Report digits whose bones differ between left and right: a joint was probably mistaken on one side."""
    sides = {hand.side: hand for hand in roles.hands}
    if "left" not in sides or "right" not in sides:
        return
    for digit in DIGITS:
        left, right = (_bones(tree, sides[side], digit) for side in ("left", "right"))
        counts = [sum(name.startswith(f"{digit}.") for name in sides[side].joints) for side in ("left", "right")]
        shared = set(left) & set(right)
        scale = np.median([left[name] / right[name] for name in shared]) if shared else 1.0
        odd = [n for n in shared if not 1 / _UNEQUAL < left[n] / right[n] / scale < _UNEQUAL]
        if odd or counts[0] != counts[1]:
            what = f"{counts[0]} joints on the left and {counts[1]} on the right" if not odd else "unlike bones"
            roles.suspicious.append(f"{digit}: {what}; if a joint was taken for another, state them with {BY_MAP}")


def _bones(tree: SourceTree, hand: HandRoles, digit: str) -> dict[str, float]:
    """Lengths of a digit's bones, by the name of the joint they start at."""
    names = [f"{digit}.{joint}" for joint in ("carpometacarpal", *FINGER_JOINTS) if f"{digit}.{joint}" in hand.joints]
    at = [tree.positions[hand.joints[name]] for name in names]
    lengths = np.linalg.norm(np.diff(np.array(at), axis=0), axis=1) if len(at) > 1 else []
    return {name: float(length) for name, length in zip(names, lengths, strict=False) if length > 0}
