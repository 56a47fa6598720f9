"""Assignment of a hand's digit chains to canonical joints, for any convention of extra or missing joints.

Whether fingers of four joints begin with a metacarpal is decided once for all hands of a file: finger by finger, the
decision would vary where proportions are near the threshold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.roles import HandRoles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["Digit", "HandDigits", "assign_hands"]

# distance from the wrist to a chain's first joint, per length of its first bone: about 0.7 where that bone is a
# metacarpal, about 2 where it is the first phalanx (WebXR, Anny, MANO)
_METACARPAL_RATIO = 1.3
_CLEAR_RATIO = 1.45  # deviation from that ratio, as a factor, that counts as one vote
# spread of the chains' first joints per spread of their second ones: metacarpals converge at the wrist
_METACARPAL_SPREAD, _CLEAR_SPREAD = 0.75, 1.3
_BARE = 0.1  # largest ratio of the last joint's skin to the one before at which it is an end
_FLESHY = 0.25  # smallest ratio at which it is certainly a joint


@dataclass
class Digit:
    """One digit's joints of the file, from the root outwards.

    Attributes:
        joints: Joint numbers.
        ranks: Rank by name of each: 0 metacarpal … 4 tip, or None.
    """

    joints: list[int]
    ranks: list[int | None]


@dataclass
class HandDigits:
    """A hand as digit chains, before their joints are assigned.

    Attributes:
        side: ``left``, ``right`` or None.
        wrist: Its wrist, if it has one.
        digits: ``thumb``, ``index``, … → joints.
    """

    side: str | None
    wrist: int | None
    digits: dict[str, Digit] = field(default_factory=dict)


def assign_hands(tree: SourceTree, hands: Sequence[HandDigits], flesh: JointFlesh) -> list[HandRoles]:
    """Canonical joints of all hands of a file, names without the side; fewer than 25 where the file has fewer."""
    for hand in hands:
        for digit in hand.digits.values():
            _drop_zero_bones(tree, digit)
    metacarpals = _fingers_begin_with_metacarpals(tree, hands, flesh)
    out = []
    for hand in hands:
        joints = {} if hand.wrist is None else {"wrist": hand.wrist}
        for name in DIGITS:
            if name in hand.digits:
                joints |= _assign(name, hand.digits[name], metacarpals)
        out.append(HandRoles(hand.side, joints))
    return out


def _drop_zero_bones(tree: SourceTree, digit: Digit) -> None:
    """Drop first bones of zero length, such as the metacarpal of Leap's thumb."""
    at = tree.positions
    size = float(np.linalg.norm(np.ptp(at[digit.joints], axis=0))) or 1.0
    while len(digit.joints) > 3 and np.linalg.norm(at[digit.joints[1]] - at[digit.joints[0]]) < 1e-3 * size:
        del digit.joints[0], digit.ranks[0]


def _assign(name: str, digit: Digit, metacarpals: bool) -> dict[str, int]:
    chain, ranks = list(digit.joints), list(digit.ranks)
    roles: dict[str, int] = {}
    if len(chain) > 1 and ranks[-1] == 4:
        roles[f"{name}.tip"] = chain.pop()
        ranks.pop()
    names = [f"{name}.{joint}" for joint in FINGER_JOINTS]
    if name == "thumb":
        if len(chain) > 3 and ("thumb.tip" in roles or metacarpals):
            chain = chain[-3:]  # drop a leading trapezium
    elif len(chain) > 1 and (
        ranks[0] == 0 or len(chain) >= 5 or (len(chain) == 4 and (f"{name}.tip" in roles or metacarpals))
    ):
        roles[f"{name}.carpometacarpal"] = chain.pop(0)
    for joint_name, joint in zip(names, chain, strict=False):
        roles.setdefault(joint_name, joint)
    return roles


def _fingers_begin_with_metacarpals(tree: SourceTree, hands: Sequence[HandDigits], flesh: JointFlesh) -> bool:
    """Decide for all fingers of four joints whether these are metacarpal to knuckle3 or base to tip.

    Votes: distance of their first joints from the wrist, spread of these, whether last joints own skin, and whether
    the thumb has as many joints (then the fingers have no additional metacarpal).
    """
    ratios, spreads, last, thumbs = [], [], [], []
    for hand in hands:
        ambiguous = {name: d.joints for name, d in hand.digits.items() if name != "thumb" and _is_ambiguous(d)}
        for chain in ambiguous.values():
            first = np.linalg.norm(tree.positions[chain[1]] - tree.positions[chain[0]])
            if hand.wrist is not None and first > 0:
                ratios.append(float(np.linalg.norm(tree.positions[chain[0]] - tree.positions[hand.wrist]) / first))
            if flesh.known:
                last.append(float(flesh.shares[chain[-1]] / max(flesh.shares[chain[-2]], 1e-12)))
        if len(ambiguous) >= 3:
            heads, second = (_spread(tree.positions[[chain[k] for chain in ambiguous.values()]]) for k in (0, 1))
            spreads.append(heads / second if second > 0 else 1.0)
        if ambiguous and "thumb" in hand.digits:
            thumb = hand.digits["thumb"]
            thumbs.append(len(thumb.joints) - (thumb.ranks[-1] == 4))
    votes = 0.0
    if ratios:
        share = np.log(_METACARPAL_RATIO / max(float(np.median(ratios)), 1e-6)) / np.log(_CLEAR_RATIO)
        votes += float(np.clip(share, -2.0, 2.0))
    if spreads:
        share = np.log(_METACARPAL_SPREAD / max(float(np.median(spreads)), 1e-6)) / np.log(_CLEAR_SPREAD)
        votes += float(np.clip(share, -1.0, 1.0))
    if last:
        owned = float(np.median(last))
        votes += -1.5 if owned < _BARE else (1.0 if owned > _FLESHY else 0.0)
    if thumbs:
        votes += 0.75 if np.median(thumbs) <= 3 else -0.75
    return votes > 0


def _is_ambiguous(digit: Digit) -> bool:
    """Whether neither names nor the number of joints determine a finger's first joint."""
    return len(digit.joints) == 4 and digit.ranks[0] != 0 and digit.ranks[-1] != 4


def _spread(points: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())
