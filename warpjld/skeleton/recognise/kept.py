"""Treatment of joints that were not recognised: kept under their own names, or merged into a recognised joint."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from warpjld.skeleton.hand import HAND_PARENTS
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["kept_joints", "lies_on_bone"]

_LIMBS = ("clavicle", "shoulder", "elbow", "hip", "knee")
_STRAIGHT = np.cos(np.radians(25.0))  # cosine of the largest rest bend at which a limb's parts count as one bone
_CHAIN = 2  # smallest number of joints with skin that form a digit of their own
_HAIR = 0.08  # smallest reach of a chain below the head that is hair or horns, per size of the skeleton
_ASIDE = 0.03  # largest distance, per length of the bone, at which a joint lies on it


def kept_joints(
    tree: SourceTree, of_source: Mapping[int, str], flesh: JointFlesh, left_out: Collection[int], notes: list[str]
) -> dict[int, str]:
    """Unrecognised joints of the file that are kept, with their names in lower case.

    Args:
        tree: The file's joints.
        of_source: Recognised joints → canonical names.
        flesh: Which joints own skin.
        left_out: Joints that the user excluded.
        notes: Notes on merged and kept joints are appended.
    """
    size = float(np.linalg.norm(np.ptp(tree.positions, axis=0))) or 1.0
    kept: dict[int, str] = {}
    merged: dict[str, list[str]] = {}
    for j in range(len(tree)):
        if j in of_source:
            continue
        over = [of_source[k] for k in tree.ancestors(j) if k in of_source]
        below = [of_source[k] for k in tree.subtree(j) if k in of_source]
        part = of_source and _is_part(tree, j, over, below, size) and not _bends_limb(tree, of_source, flesh, j)
        part = part and not _chain_of_its_own(tree, of_source, flesh, j)
        if j in left_out or _is_inert(tree, flesh, j) or part:
            into = over[0] if over else (below[0] if below else "the joint above")
            merged.setdefault(into, []).append(tree.names[j])
        elif of_source and over and over[0].rpartition(".")[2] in _LIMBS and lies_on_bone(tree, j):
            merged.setdefault(over[0], []).append(tree.names[j])
        else:
            kept[j] = _own_name(tree, j)
    if not kept and not of_source:  # otherwise the skeleton would be empty
        kept = {j: _own_name(tree, j) for j in range(len(tree))}
        merged.clear()
    if merged:
        shown = (
            f"{', '.join(names[:4])}{f' and {len(names) - 4} more' if len(names) > 4 else ''} → {into}"
            for into, names in merged.items()
        )
        notes.append(f"merged into {'recognised joints' if of_source else 'others'}: {'; '.join(shown)}")
    if kept and of_source:
        notes.append(f"not recognised, kept as joints: {', '.join(kept.values())}")
    return kept


def _is_inert(tree: SourceTree, flesh: JointFlesh, joint: int) -> bool:
    """Whether a joint neither moves skin, nor ends a bone, nor is a branching point of joints with skin."""
    if tree.flat:
        return flesh.known and bool(flesh.bare[joint])
    return bool(flesh.dead[joint] or flesh.passing[joint])


def _is_part(tree: SourceTree, joint: int, over: list[str], below: list[str], size: float) -> bool:
    """Whether an unrecognised joint belongs to a recognised one."""
    beside = [k for k in range(len(tree)) if tree.parents[k] == tree.parents[joint] and k != joint]
    near = [tree.parents[joint], *beside]
    double = not tree.children[joint] and any(
        k >= 0 and np.linalg.norm(tree.positions[joint] - tree.positions[k]) < 1e-4 * size for k in near
    )
    helper = read_name(tree.names[joint]).kind in ("helper", "palm", "root")
    in_hand = bool(over) and over[0].partition(".")[2] in HAND_PARENTS
    return bool(below) or helper or double or in_hand or "head" in over or (not over and tree.flat)


def _bends_limb(tree: SourceTree, of_source: Mapping[int, str], flesh: JointFlesh, joint: int) -> bool:
    """Whether a joint with skin bends a limb between two recognised joints, as an animal's hock does."""
    over = next((k for k in tree.ancestors(joint) if k in of_source), None)
    below = next((k for k in tree.subtree(joint) if k in of_source), None)
    if over is None or below is None or of_source[over].rpartition(".")[2] not in _LIMBS[1:]:
        return False
    if not flesh.known or flesh.bare[joint]:
        return False
    at = tree.positions
    upper, lower = at[joint] - at[over], at[below] - at[joint]
    lengths = float(np.linalg.norm(upper) * np.linalg.norm(lower))
    return lengths > 0.0 and float(upper @ lower) < _STRAIGHT * lengths


def _chain_of_its_own(tree: SourceTree, of_source: Mapping[int, str], flesh: JointFlesh, joint: int) -> bool:
    """Whether a joint belongs to a chain with skin that leaves the palm beside the known digits (a sixth finger), or
    hangs far down from the head (hair)."""
    if tree.flat or not flesh.known or flesh.dead[joint]:
        return False
    line = [joint]
    while (above := int(tree.parents[line[-1]])) >= 0 and above not in of_source:
        line.append(above)
    word = of_source[above].rpartition(".")[2] if above >= 0 else ""
    if word not in ("wrist", "carpometacarpal", "head"):
        return False
    chain = [j for j in tree.subtree(line[-1]) if not flesh.dead[j]]
    fleshy = [j for j in chain if not flesh.bare[j]]
    if any(sum(not flesh.dead[c] for c in tree.children[j]) > 1 for j in chain):
        return False  # a face, or a held object
    helper = any(read_name(tree.names[j]).kind in ("helper", "palm") for j in chain)
    if word == "head":  # short chains such as jaw and tongue belong to the head
        reach = max(float(np.linalg.norm(tree.positions[j] - tree.positions[above])) for j in chain)
        if reach < _HAIR * float(np.linalg.norm(np.ptp(tree.positions, axis=0))):
            return False
    return len(fleshy) >= _CHAIN and not helper and not any(j in of_source for j in chain)


def lies_on_bone(tree: SourceTree, joint: int) -> bool:
    """Whether a leaf lies on the bone from its parent to a sibling: a twist joint, which does not bend the limb."""
    parent = int(tree.parents[joint])
    if parent < 0 or tree.children[joint]:
        return False
    at = tree.positions
    for sibling in tree.children[parent]:
        bone = at[sibling] - at[parent]
        square = float(bone @ bone)
        if sibling == joint or square == 0.0 or not tree.children[sibling]:
            continue
        share = float((at[joint] - at[parent]) @ bone) / square
        aside = float(np.linalg.norm(at[joint] - at[parent] - share * bone))
        if -_ASIDE <= share <= 1.0 + _ASIDE and aside <= _ASIDE * square**0.5:
            return True
    return False


def _own_name(tree: SourceTree, joint: int) -> str:
    name = tree.names[joint].lower()
    twice = [j for j in range(len(tree)) if tree.names[j].lower() == name]
    return name if len(twice) == 1 else f"{name}#{twice.index(joint) + 1}"
