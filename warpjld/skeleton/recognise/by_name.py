"""Recognition of joints by their names, in any convention that :mod:`names` reads."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.digit_chain import digit_chain
from warpjld.skeleton.recognise.digits import HandDigits, assign_hands
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.names import Meaning, read_name
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["roles_by_name"]

# canonical joint: kinds that may stand for it, best first; "shoulder" is the joint itself in SMPL-X and the clavicle in
# Mixamo, Godot and VRM, so it is used for whichever has no more specific name
_ARM = (
    ("shoulder", ("upperarm", "shoulder")),
    ("elbow", ("forearm",)),
    ("clavicle", ("clavicle", "scapula", "shoulder")),
)
_PALM = ("index", "middle", "ring", "pinky")
_LEG = (("hip", ("thigh", "hip")), ("knee", ("shin",)), ("ankle", ("ankle", "foot")), ("ball", ("ball", "foot")))


def roles_by_name(tree: SourceTree, flesh: JointFlesh | None = None) -> Roles:
    """Roles found by names; empty where no name is understood.

    Joints that own skin have priority over others of the same name; joints that neither own skin nor end a bone are
    ignored.
    """
    flesh = flesh or JointFlesh(tree, None)
    meanings = [Meaning() if flesh.dead[j] else read_name(name) for j, name in enumerate(tree.names)]
    for j in map(int, np.flatnonzero(flesh.passing)):  # a joint with descendants that own skin is no end
        if meanings[j].rank == 4 or (meanings[j].kind or "").endswith(" end"):
            meanings[j] = Meaning()
    roles = Roles(how="names")
    kinds: dict[tuple[str | None, str], list[int]] = defaultdict(list)
    for j in sorted(range(len(tree)), key=lambda j: (bool(flesh.bare[j]), tree.depth(j), meanings[j].number or 0, j)):
        if meanings[j].kind:
            kinds[meanings[j].side, str(meanings[j].kind)].append(j)
    sides: list[str | None] = [*sorted({side for side, _ in kinds if side})] or [None]
    if sides != [None] and any(meanings[j].kind == "digit" and meanings[j].side is None for j in range(len(tree))):
        sides.append(None)
    hands: list[HandDigits] = []
    for side in sides:
        hand = _hand(tree, meanings, kinds, side, flesh)
        if hand is not None and hand.digits:
            hands.append(hand)
        elif hand is not None and side and hand.wrist is not None:
            roles.body[f"{side}.wrist"] = hand.wrist
        if side:
            _limbs(kinds, side, roles)
            _forearm_stub(tree, side, roles)
            if kinds[side, "hand end"] and f"{side}.wrist" in roles.body:
                roles.body[f"{side}.hand.tip"] = kinds[side, "hand end"][0]
            _toes(tree, kinds, side, roles, flesh)
    roles.hands = assign_hands(tree, hands, flesh)
    _trunk(tree, kinds, roles, flesh)
    return roles


def _hand(
    tree: SourceTree,
    meanings: list[Meaning],
    kinds: dict[tuple[str | None, str], list[int]],
    side: str | None,
    flesh: JointFlesh,
) -> HandDigits | None:
    digits: dict[str, list[int]] = defaultdict(list)
    for j in kinds[side, "digit"]:
        digits[str(meanings[j].digit)].append(j)
    for j in kinds[side, "carpal"]:
        below = {meanings[k].digit for k in tree.subtree(j) if meanings[k].kind == "digit"}
        if len(below) == 1:
            digits[str(below.pop())].insert(0, j)
    carpals = kinds[side, "carpal"]
    if tree.flat and len(carpals) == len(_PALM):  # numbered from the index finger (MakeHuman, DAZ, Rigify)
        for digit, j in zip(_PALM, sorted(carpals, key=lambda j: meanings[j].number or 0), strict=True):
            digits[digit].append(j)
    named = kinds[side, "wrist"]
    named = [j for j in named if not flesh.bare[j]] or sorted(named, key=lambda j: -len(tree.names[j]))
    wrists = named or kinds[side, "hand"] or (kinds[None, "wrist"] or kinds[None, "hand"])
    wrist = wrists[-1] if named else (wrists[0] if wrists else None)
    if wrist is None and digits:
        wrist = _common_ancestor(tree, [joints[0] for joints in digits.values()])
    chains = {digit: digit_chain(tree, digits[digit], meanings, flesh, wrist) for digit in DIGITS if digits[digit]}
    found = {digit: chain for digit, chain in chains.items() if chain is not None}
    return None if wrist is None and not found else HandDigits(side, wrist, found)


def _common_ancestor(tree: SourceTree, joints: list[int]) -> int | None:
    above = [tree.ancestors(j) for j in joints]
    return next((j for j in above[0] if all(j in other for other in above[1:])), None)


def _limbs(kinds: dict[tuple[str | None, str], list[int]], side: str, roles: Roles) -> None:
    for table in (_ARM, _LEG):
        taken: set[str] = set()
        for name, candidates in table:
            kind = next((k for k in candidates if kinds[side, k] and k not in taken), None)
            if kind:
                taken.add(kind)
                # of upperarm01 and upperarm02 the first is the joint, the others subdivide the limb
                roles.body[f"{side}.{name}"] = kinds[side, kind][0]


def _forearm_stub(tree: SourceTree, side: str, roles: Roles) -> None:
    """Rename the elbow of the built-in hand, whose skeleton is cut off at the forearm, to ``forearm``."""
    elbow = roles.body.get(f"{side}.elbow")
    if elbow is not None and tree.names[elbow] == f"{side}.forearm":
        roles.body[f"{side}.forearm"] = roles.body.pop(f"{side}.elbow")


def _toes(
    tree: SourceTree, kinds: dict[tuple[str | None, str], list[int]], side: str, roles: Roles, flesh: JointFlesh
) -> None:
    toes = [j for j in kinds[side, "toe"] if not flesh.passing[j]]
    heads = [j for j in toes if not set(tree.ancestors(j)) & set(toes)]
    if len(heads) == 1:
        rest = [j for j in tree.subtree(heads[0]) if not flesh.dead[j] and not flesh.passing[j]]
        if f"{side}.ball" not in roles.body:
            roles.body[f"{side}.ball"] = rest.pop(0)
        if rest:
            roles.body[f"{side}.toe.tip"] = rest[-1]
        return
    chains = [[j for j in tree.subtree(head) if not flesh.dead[j] and not flesh.passing[j]] for head in heads]
    for n, rest in enumerate(_numbered_chains(tree, side, toes, roles) if tree.flat else chains, start=1):
        for name, joint in zip(FINGER_JOINTS, rest, strict=False):
            roles.body[f"{side}.toe{n}.{'tip' if read_name(tree.names[joint]).rank == 4 else name}"] = joint


def _numbered_chains(tree: SourceTree, side: str, toes: list[int], roles: Roles) -> list[list[int]]:
    """Toes of a file without a hierarchy: joints of one number, from the ankle outwards."""
    if not toes:
        return []
    ankle = roles.body.get(f"{side}.ankle")
    start = tree.positions[toes].mean(axis=0) if ankle is None else tree.positions[ankle]
    chains: dict[int, list[int]] = {}
    for j in sorted(toes, key=lambda j: float(np.linalg.norm(tree.positions[j] - start))):
        chains.setdefault(read_name(tree.names[j]).number or 0, []).append(j)
    return [chains[number] for number in sorted(chains)]


def _trunk(tree: SourceTree, kinds: dict[tuple[str | None, str], list[int]], roles: Roles, flesh: JointFlesh) -> None:
    if not (kinds[None, "spine"] or kinds[None, "pelvis"] or kinds[None, "head"]):
        return
    for name in ("spine", "neck"):
        hips = [roles.body[f"{side}.hip"] for side in ("left", "right") if f"{side}.hip" in roles.body]
        if tree.flat and hips:  # numbers may count downwards
            start = tree.positions[hips].mean(axis=0)
            kinds[None, name].sort(key=lambda j: float(np.linalg.norm(tree.positions[j] - start)))
        fleshy = [j for j in kinds[None, name] if not flesh.bare[j]]
        for n, joint in enumerate(fleshy or kinds[None, name], start=1):
            roles.body[f"{name}{n}"] = joint
    for kind, name in (("head", "head"), ("head end", "head.top")):
        if kinds[None, kind]:
            roles.body[name] = kinds[None, kind][0]
    if kinds[None, "pelvis"]:
        roles.body["pelvis"] = kinds[None, "pelvis"][0]
    elif kinds[None, "root"]:
        roles.body["pelvis"] = kinds[None, "root"][0]
