"""Check of arms and legs, as recognised by names, against the geometry of their chains; conflicts are resolved.

A leg is a chain of joints from the crotch to the ankle; hip and knee divide it into two segments of similar length, at
the same places on both sides. So ``LeftLeg`` above ``LeftShin`` is a thigh, whatever it is elsewhere.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.limbs import (
    FOREARM_RATIO,
    SHIN_RATIO,
    ankle_of,
    divide_limb,
    limb_misfit,
    path_below,
)
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import BY_MAP, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["check_limbs"]

_MAP = f"state it with {BY_MAP}"
_PLAUSIBLE = np.log(2.0)  # largest plausible misfit: lower per upper segment half or twice the usual
_CLEARLY_BETTER = np.log(1.3)  # smallest difference of misfits by which one division of a limb is clearly better
_AT_TRUNK = 0.03  # joints nearer to the branching joint than this share of the limb do not belong to it
_UNEQUAL = 1.25  # suspicious ratio of lengths on both sides


@dataclass(frozen=True)
class _Kind:
    """Names of a limb's parts: its two joints, its end, and the usual ratio of its segments."""

    word: str
    first: str
    second: str
    end: str
    ratio: float


_ARM = _Kind("arm", "shoulder", "elbow", "wrist", FOREARM_RATIO)
_LEG = _Kind("leg", "hip", "knee", "ankle", SHIN_RATIO)


@dataclass
class _Limb:
    side: str
    chain: list[int]  # from the branching joint (excluded) to wrist or ankle
    named: tuple[int | None, int | None] = (None, None)
    fixed: dict[int, Collection[int]] = field(default_factory=dict)
    found: tuple[int, int] | None = None


def check_limbs(tree: SourceTree, roles: Roles, flesh: JointFlesh, stated: Collection[str] = ()) -> None:
    """Correct hips, knees, shoulders, elbows and their dependants in ``roles``; joints ``stated`` are kept.

    Only in a body's hierarchy: a hand with a forearm, or a flat file, has no chains to compare with.
    """
    if tree.flat or not any(name == "pelvis" or name.startswith(("spine", "head", "neck")) for name in roles.body):
        return
    for kind in (_LEG, _ARM):
        limbs = _limbs(tree, roles, flesh, kind, stated)
        _divide(tree, limbs, kind)
        for limb in limbs:
            _apply(tree, roles, limb, kind, stated)
        _compare_sides(tree, roles, kind)


def _limbs(tree: SourceTree, roles: Roles, flesh: JointFlesh, kind: _Kind, stated: Collection[str]) -> list[_Limb]:
    ends = {}
    for side in ("left", "right"):
        end = _end(tree, roles, flesh, kind, side)
        if end is not None:
            ends[side] = end
    trunk = {j for name, j in roles.body.items() if "." not in name or name == "head.top"}
    out = []
    for side, end in ends.items():
        other = ends.get("right" if side == "left" else "left")
        above = _branching_joint(tree, roles, end, other, trunk)
        if above is None:
            continue
        chain = [j for j in path_below(tree, above, end) if j not in trunk]
        size = float(np.linalg.norm(tree.positions[end] - tree.positions[above])) or 1.0
        chain = [j for j in chain if j == end or not _is_helper(tree, flesh, j, above, size)]
        names = (f"{side}.{kind.first}", f"{side}.{kind.second}")
        limb = _Limb(side, chain, (roles.body.get(names[0]), roles.body.get(names[1])))
        for k, name in enumerate(names):
            if name in stated and name in roles.body:
                limb.fixed[k] = (roles.body[name],)
        if len(chain) >= 2:
            out.append(limb)
    return out


def _is_helper(tree: SourceTree, flesh: JointFlesh, joint: int, above: int, size: float) -> bool:
    if read_name(tree.names[joint]).kind == "helper":
        return True
    if flesh.passing[joint] and flesh.on_the_way(joint):
        return True
    return float(np.linalg.norm(tree.positions[joint] - tree.positions[above])) < _AT_TRUNK * size


def _end(tree: SourceTree, roles: Roles, flesh: JointFlesh, kind: _Kind, side: str) -> int | None:
    """Wrist or ankle: by name, or else searched down the known part of the limb."""
    if kind is _ARM:
        hand = next((h for h in roles.hands if h.side == side), None)
        if hand is not None and "wrist" in hand.joints:
            return hand.joints["wrist"]
    named = roles.body.get(f"{side}.{kind.end}")
    if named is not None:
        return named
    if kind is _ARM:
        return _wrist(tree, roles, flesh, side)
    known = [roles.body[name] for part in ("knee", "hip") if (name := f"{side}.{part}") in roles.body]
    if not known:
        return None
    leg = [known[0]]
    while len(below := [c for c in tree.children[leg[-1]] if flesh.live[c]]) == 1:
        leg.append(below[0])
    ball = roles.body.get(f"{side}.ball")
    if ball in leg[2:]:
        ankle = leg[leg.index(ball) - 1]
    elif len(leg) > 1:
        above = [j for j in (int(tree.parents[leg[0]]),) if j >= 0]  # the ankle is searched in the leg's lower half
        whole = [*above, *leg]
        ankle = whole[ankle_of(tree, whole)]
    else:
        return None
    _remove_roles(roles, ankle)
    roles.body[f"{side}.ankle"] = ankle
    roles.notes.append(f"{side}.ankle '{tree.names[ankle]}': by the leg's shape")
    return ankle


def _wrist(tree: SourceTree, roles: Roles, flesh: JointFlesh, side: str) -> int | None:
    """Of a chain of joints below the shoulder (``arm_joint_L_1`` …), the one that gives a forearm of usual length."""
    shoulder = roles.body.get(f"{side}.shoulder")
    if shoulder is None or f"{side}.elbow" in roles.body:
        return None
    arm = [shoulder]
    while len(below := [c for c in tree.children[arm[-1]] if flesh.live[c]]) == 1:
        arm.append(below[0])
    if set(arm[1:]) & {*roles.body.values(), *(j for hand in roles.hands for j in hand.joints.values())}:
        return None
    misfits = {arm[k]: divide_limb(tree, arm[: k + 1], FOREARM_RATIO, {0: (shoulder,)})[2] for k in range(2, len(arm))}
    wrist = min(misfits, key=lambda j: misfits[j], default=None)
    if wrist is None or misfits[wrist] >= _PLAUSIBLE:
        return None
    roles.body[f"{side}.wrist"] = wrist
    roles.notes.append(f"{side}.wrist '{tree.names[wrist]}': by the arm's shape")
    return wrist


def _branching_joint(tree: SourceTree, roles: Roles, end: int, other: int | None, trunk: set[int]) -> int | None:
    """Lowest common ancestor of both limbs of a kind, or of one limb and the trunk."""
    above = tree.ancestors(end)
    if other is not None:
        both = set(tree.ancestors(other))
        return next((j for j in above if j in both), None)
    return next((j for j in above if j in trunk), above[-1] if above else None)


def _divide(tree: SourceTree, limbs: list[_Limb], kind: _Kind) -> None:
    """Find first and second joint of each limb: as named if plausible, else mirrored from the other side, else by
    geometry."""
    for limb in limbs:
        first, second = limb.named
        if first is not None and second is not None and _is_plausible(tree, limb, (first, second), kind):
            limb.found = _resolve_ambiguous_name(tree, limb, first, second, kind)
    undecided = [limb for limb in limbs if limb.found is None]
    for limb in undecided:
        other = next((o for o in limbs if o is not limb and o.found and len(o.chain) == len(limb.chain)), None)
        if other is not None and other.found is not None and not limb.fixed:
            mirrored = (
                limb.chain[other.chain.index(other.found[0])],
                limb.chain[other.chain.index(other.found[1])],
            )
            if _is_plausible(tree, limb, mirrored, kind):
                limb.found = mirrored
                continue
        limb.found = _by_geometry(tree, limb, kind)


def _resolve_ambiguous_name(tree: SourceTree, limb: _Limb, first: int, second: int, kind: _Kind) -> tuple[int, int]:
    """Decide by lengths whether ``Shoulder`` is the joint or the clavicle, ``Hip`` the joint or part of the pelvis."""
    if 0 in limb.fixed or read_name(tree.names[first]).kind not in ("shoulder", "hip"):
        return first, second
    own = divide_limb(tree, limb.chain, kind.ratio, {0: (first,), 1: (second,)})[2]
    other, _, misfit = divide_limb(tree, limb.chain, kind.ratio, {1: (second,)})
    return (other if misfit + _CLEARLY_BETTER < own else first), second


def _by_geometry(tree: SourceTree, limb: _Limb, kind: _Kind) -> tuple[int, int] | None:
    """The division of a limb with the smallest misfit, keeping named joints if that is plausible."""
    named = {k: (j,) for k, j in enumerate(limb.named) if j is not None and j in limb.chain}
    tries: list[dict[int, Collection[int]]] = [{**named, **limb.fixed}, limb.fixed]
    for fixed in tries:
        first, second, misfit = divide_limb(tree, limb.chain, kind.ratio, fixed)
        if misfit < _PLAUSIBLE:
            return first, second
    return None


def _is_plausible(tree: SourceTree, limb: _Limb, pair: tuple[int, int], kind: _Kind) -> bool:
    first, second = pair
    if first not in limb.chain or second not in limb.chain[:-1]:
        return False
    if limb.chain.index(first) >= limb.chain.index(second):
        return False
    if any(limb.fixed.get(k, (j,)) != (j,) for k, j in enumerate(pair)):
        return False
    at = tree.positions
    end = at[limb.chain[-1]]
    whole = max(float(np.linalg.norm(at[j] - end)) for j in limb.chain)
    return limb_misfit(at[first], at[second], end, whole, kind.ratio) < _PLAUSIBLE


def _apply(tree: SourceTree, roles: Roles, limb: _Limb, kind: _Kind, stated: Collection[str]) -> None:
    names = (f"{limb.side}.{kind.first}", f"{limb.side}.{kind.second}")
    if limb.found is None:
        first, second = limb.named
        missing = [name for name, joint in zip(names, limb.named, strict=True) if joint is None]
        if missing and not set(missing) & set(stated):
            between = f"between '{tree.names[limb.chain[0]]}' and '{tree.names[limb.chain[-1]]}'"
            what = " and ".join(name.partition(".")[2] for name in missing)
            roles.suspicious.append(
                f"{limb.side} {kind.word}: no {what} found {between}: it does not bend there; if one is there, {_MAP}"
            )
        elif first in limb.chain and second in limb.chain and first is not None and second is not None:
            roles.suspicious.append(
                f"{limb.side} {kind.word}: '{tree.names[first]}' and '{tree.names[second]}' "
                f"part it into segments of odd lengths for {kind.first} and {kind.second}; if others are meant, {_MAP}"
            )
        return
    changed = []
    for name, joint in zip(names, limb.found, strict=True):
        if roles.body.get(name) != joint and name not in stated:
            _remove_roles(roles, joint)
            roles.body[name] = joint
            changed.append(f"{name} '{tree.names[joint]}'")
    if changed:
        roles.notes.append(f"{', '.join(changed)}: by the {kind.word}'s shape")
    if kind is _ARM:
        _clavicle(tree, roles, limb, stated)


def _clavicle(tree: SourceTree, roles: Roles, limb: _Limb, stated: Collection[str]) -> None:
    """Set the clavicle to the first joint between trunk and shoulder, unless the named one is already among these."""
    name = f"{limb.side}.clavicle"
    assert limb.found is not None
    before = limb.chain[: limb.chain.index(limb.found[0])]
    if name in stated or roles.body.get(name) in before:
        return
    roles.body.pop(name, None)
    if before and not set(before) & set(roles.body.values()):
        roles.body[name] = before[0]
        roles.notes.append(f"{name} '{tree.names[before[0]]}': by the arm's shape")


def _remove_roles(roles: Roles, joint: int) -> None:
    for name in [name for name, j in roles.body.items() if j == joint]:
        del roles.body[name]


def _compare_sides(tree: SourceTree, roles: Roles, kind: _Kind) -> None:
    """Report segments of clearly different length on both sides."""
    ends = {h.side: h.joints["wrist"] for h in roles.hands if "wrist" in h.joints} if kind is _ARM else {}
    for a, b in ((kind.first, kind.second), (kind.second, kind.end)):
        lengths = []
        for side in ("left", "right"):
            near = roles.body.get(f"{side}.{a}")
            far = roles.body.get(f"{side}.{b}", ends.get(side) if b == kind.end else None)
            if near is not None and far is not None:
                lengths.append(float(np.linalg.norm(tree.positions[far] - tree.positions[near])))
        if len(lengths) == 2 and max(lengths) > _UNEQUAL * min(lengths):
            share = max(lengths) / max(min(lengths), 1e-12) - 1
            roles.suspicious.append(
                f"{kind.word}s: from {a} to {b} one side is {share:.0%} longer than the other; if a joint was taken "
                f"for another, {_MAP}"
            )
