"""Recognition of bodies by the tree's shape: two arms that end in hands, a trunk, two legs and a head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.hand_frame import chirality
from warpjld.skeleton.recognise.limbs import FOREARM_RATIO, SHIN_RATIO, ankle_of, divide_limb, path_below, toes_by_place
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["body_by_shape"]


def body_by_shape(tree: SourceTree, hands: list[dict[str, int]]) -> Roles:
    """Roles of a body whose two hands are known; sides are found from the hands' chirality and the feet."""
    roles = Roles(how="shape")
    wrists = [hand["wrist"] for hand in hands]
    chest = next(j for j in tree.ancestors(wrists[0]) if j in tree.ancestors(wrists[1]))
    trunk = [chest, *tree.ancestors(chest)]
    legs, pelvis = _legs(tree, trunk)
    sides = _sides(tree, hands, legs)
    for side, hand in zip(sides, hands, strict=True):
        roles.hands.append(HandRoles(side, hand))
        arm = path_below(tree, chest, hand["wrist"])
        roles.body |= _limb(tree, arm, side, ("shoulder", "elbow"), FOREARM_RATIO)
        shoulder = arm.index(roles.body[f"{side}.shoulder"])
        if shoulder > 0:
            roles.body[f"{side}.clavicle"] = arm[0]
    middle = np.mean([tree.positions[leg[-1]] for leg in legs] or [np.zeros(3)], axis=0)
    for side, leg in zip(_leg_sides(tree, sides, wrists, legs), legs, strict=True):
        ankle = ankle_of(tree, leg)
        roles.body |= _limb(tree, leg[: ankle + 1], side, ("hip", "knee"), SHIN_RATIO)
        roles.body[f"{side}.ankle"] = leg[ankle]
        roles.body |= _toes(tree, leg, ankle, side, middle)
    for n, joint in enumerate(trunk[: trunk.index(pelvis)][::-1], start=1):
        roles.body[f"spine{n}"] = joint
    roles.body["pelvis"] = pelvis
    roles.body |= _head(tree, chest, wrists)
    return roles


def _legs(tree: SourceTree, trunk: list[int]) -> tuple[list[list[int]], int]:
    """The two longest chains that branch off the trunk at one joint below the chest, and that joint."""
    for joint in trunk[1:]:
        heads = [c for c in tree.children[joint] if c not in trunk]
        if heads:
            chains = [c for head in heads if len(c := _unbranched_chain(tree, head)) >= 3]
            if len(chains) >= 2:
                return sorted(chains, key=lambda c: -_length(tree, c))[:2], joint
    return [], trunk[-1]


def _unbranched_chain(tree: SourceTree, head: int) -> list[int]:
    chain = [head]
    while len(tree.children[chain[-1]]) == 1:
        chain.append(tree.children[chain[-1]][0])
    return chain


def _length(tree: SourceTree, chain: list[int]) -> float:
    return float(np.linalg.norm(np.diff(tree.positions[chain], axis=0), axis=1).sum())


def _limb(tree: SourceTree, chain: list[int], side: str, names: tuple[str, str], ratio: float) -> dict[str, int]:
    first, second, _ = divide_limb(tree, chain, ratio)
    return {f"{side}.{names[0]}": first, f"{side}.{names[1]}": second}


def _toes(tree: SourceTree, leg: list[int], ankle: int, side: str, middle: NDArray[np.float64]) -> dict[str, int]:
    if ankle + 1 < len(leg):
        return {f"{side}.ball": leg[ankle + 1]}
    heads = tree.children[leg[ankle]]
    if len(heads) == 1:
        return {f"{side}.ball": heads[0]}
    return toes_by_place(tree, heads, side, tree.positions[leg[ankle]] - middle)


def _head(tree: SourceTree, chest: int, wrists: list[int]) -> dict[str, int]:
    rest = [c for c in tree.children[chest] if not any(c == w or c in tree.ancestors(w) for w in wrists)]
    if not rest:
        return {}
    chain = max((_unbranched_chain(tree, head) for head in rest), key=lambda c: _length(tree, c))
    leaf = not tree.children[chain[-1]]
    last = len(chain) - 2 if leaf and len(chain) >= 3 else len(chain) - 1  # a third joint is the top of the head
    return {"head": chain[last]} | {f"neck{n}": joint for n, joint in enumerate(chain[:last], start=1)}


def _sides(tree: SourceTree, hands: list[dict[str, int]], legs: list[list[int]]) -> list[str]:
    turns = [chirality({name: tree.positions[j] for name, j in hand.items()}) for hand in hands]
    if turns[0] * turns[1] < 0:
        return ["right" if turn > 0 else "left" for turn in turns]
    wrists = np.array([tree.positions[hand["wrist"]] for hand in hands])
    hips = np.array([tree.positions[leg[0]] for leg in legs] or [wrists.mean(axis=0)])
    feet: NDArray[np.float64] = np.zeros(3)
    for leg in legs:
        ankle = ankle_of(tree, leg)
        beyond = leg[ankle + 1 :] or list(tree.children[leg[-1]])
        if beyond:
            feet += tree.positions[beyond].mean(axis=0) - tree.positions[leg[ankle]]
    up = wrists.mean(axis=0) - hips.mean(axis=0)
    left = np.cross(up, feet)
    first = "left" if float(left @ (wrists[0] - wrists[1])) > 0 else "right"
    return [first, "right" if first == "left" else "left"]


def _leg_sides(tree: SourceTree, sides: list[str], wrists: list[int], legs: list[list[int]]) -> list[str]:
    if len(legs) < 2:
        return sides[: len(legs)]
    across = tree.positions[wrists[0]] - tree.positions[wrists[1]]
    ends = tree.positions[legs[0][-1]] - tree.positions[legs[1][-1]]
    return sides if float(across @ ends) > 0 else sides[::-1]
