"""Rejection of false positives of recognition: limbs of animals, arms of machines, fingers of no hand."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["reject_unfounded"]

_SEGMENTS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
_HANGS = -0.5  # cosine between legs and trunk below which a body stands upright
_ALONGSIDE = 0.5  # cosine between arms and legs above which arms stand on the ground, too
_FINGERS = ("index", "middle", "ring", "pinky")
_LONGEST_FINGER = 4.0  # largest ratio of the longest finger to the shortest
_WIDEST = 3.0  # largest distance of two finger bases, per mean length of the fingers
_TOGETHER = 0.3  # smallest length of the mean of the fingers' unit directions


def reject_unfounded(tree: SourceTree, roles: Roles, stated: Collection[str] = ()) -> None:
    """Remove from ``roles`` hands and bodies that names or shape proposed but geometry contradicts.

    Nothing is rejected where the user ``stated`` joints.
    """
    if stated:
        return
    of_body, doubts = len(roles.notes), len(roles.suspicious)
    for hand in [h for h in roles.hands if not _is_hand(tree, h)]:
        roles.hands.remove(hand)
        words = ", ".join(f"'{tree.names[j]}'" for j in list(hand.joints.values())[:3])
        roles.notes.append(f"{words}{', …' if len(hand.joints) > 3 else ''}: named like fingers, but they form no hand")
    if roles.body and not roles.hands and not _is_body(tree, roles):
        _remove_body(roles, of_body, doubts)
        roles.notes.append("some joints are named like limbs, but they form none: joints keep their names")
    if roles.body and (_on_all_fours(tree, roles) or _has_two_legs_on_a_side(tree)):
        _remove_body(roles, of_body, doubts)
        roles.hands.clear()
        roles.notes.append("an animal's limbs, not an upright body's: joints keep their names")


def _remove_body(roles: Roles, notes: int, doubts: int) -> None:
    """Remove the body, and the notes on its limbs: the first ``notes`` and ``doubts``."""
    roles.body.clear()
    del roles.notes[:notes], roles.suspicious[:doubts]


def _is_hand(tree: SourceTree, hand: HandRoles) -> bool:
    at = tree.positions
    chains = {d: [at[j] for name, j in hand.joints.items() if name.startswith(f"{d}.")] for d in (*_FINGERS, "thumb")}
    chains = {digit: chain for digit, chain in chains.items() if chain}
    if len(chains) < 2 or max(len(chain) for chain in chains.values()) < 2:
        # a single finger counts as part of a hand if its name also states the side
        return hand.side is not None and max((len(chain) for chain in chains.values()), default=0) >= 2
    fingers = [chain for digit, chain in chains.items() if digit != "thumb" and len(chain) >= 2]
    if len(fingers) < 2:
        return hand.side is not None
    lengths = [_length(chain) for chain in fingers]
    mean = float(np.mean(lengths))
    heads = np.array([chain[0] for chain in fingers])
    apart = float(np.linalg.norm(heads[:, None] - heads[None], axis=2).max())
    together = float(np.linalg.norm(np.mean([_heading(chain) for chain in fingers], axis=0)))
    return max(lengths) <= _LONGEST_FINGER * min(lengths) and apart <= _WIDEST * mean and together >= _TOGETHER


def _length(chain: list[NDArray[np.float64]]) -> float:
    return float(np.linalg.norm(np.diff(np.array(chain), axis=0), axis=1).sum())


def _heading(chain: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    away: NDArray[np.float64] = chain[-1] - chain[0]
    return unit(away) if np.linalg.norm(away) > 0 else away


def _is_body(tree: SourceTree, roles: Roles) -> bool:
    """Whether there is a limb of two joints in one chain, or a trunk with a head in one chain."""
    if tree.flat:
        return len(roles.body) > 2
    pairs = [(f"{side}.{a}", f"{side}.{b}") for side in ("left", "right") for a, b in _SEGMENTS]
    if any(
        a in roles.body and b in roles.body and _is_descendant(tree, roles.body[a], roles.body[b]) for a, b in pairs
    ):
        return True
    trunk = [name for name in roles.body if name.startswith(("spine", "neck")) or name == "pelvis"]
    head = roles.body.get("head")
    if head is None:
        return len(trunk) >= 2
    return any(_is_descendant(tree, roles.body[name], head) for name in trunk)


def _is_descendant(tree: SourceTree, above: int, joint: int) -> bool:
    return above in tree.ancestors(joint)


def _on_all_fours(tree: SourceTree, roles: Roles) -> bool:
    """Whether legs are not opposite to the trunk, and arms, if any, are parallel to the legs."""
    at, body = tree.positions, roles.body
    legs = _mean_direction(at, body, ("hip", "knee", "ankle"))
    top = next((body[name] for name in ("neck1", "head") if name in body), None)
    if legs is None or top is None or "pelvis" not in body:
        return False
    trunk = at[top] - at[body["pelvis"]]
    if np.linalg.norm(trunk) == 0 or float(unit(trunk) @ legs) < _HANGS:
        return False
    arms = _mean_direction(at, body, ("shoulder", "elbow", "wrist"))
    return arms is None or float(arms @ legs) > _ALONGSIDE


def _mean_direction(
    at: NDArray[np.float64], body: dict[str, int], parts: tuple[str, ...]
) -> NDArray[np.float64] | None:
    bones = []
    for side in ("left", "right"):
        line = [body[name] for part in parts if (name := f"{side}.{part}") in body]
        if len(line) >= 2 and np.linalg.norm(at[line[-1]] - at[line[0]]) > 0:
            bones.append(unit(at[line[-1]] - at[line[0]]))
    mean = np.mean(bones, axis=0) if bones else np.zeros(3)
    return unit(mean) if np.linalg.norm(mean) > 1e-6 else None


def _has_two_legs_on_a_side(tree: SourceTree) -> bool:
    """Whether one side has two legs: chains named as legs, of similar length, neither a descendant of the other."""
    for side in ("left", "right"):
        legs = [j for j, name in enumerate(tree.names) if _is_leg(name, side)]
        heads = [j for j in legs if not set(tree.ancestors(j)) & set(legs)]
        lengths = []
        for head in heads:
            line = [j for j in tree.subtree(head) if j in legs]
            if len(line) >= 2:
                lengths.append(float(np.linalg.norm(tree.positions[line[-1]] - tree.positions[head])))
        lengths.sort()
        if not tree.flat and len(lengths) >= 2 and lengths[-2] > 0.5 * lengths[-1]:
            return True
    return False


def _is_leg(name: str, side: str) -> bool:
    meaning = read_name(name)
    return meaning.side == side and meaning.kind in ("thigh", "shin", "hip")
