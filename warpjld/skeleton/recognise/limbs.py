"""Division of a chain of joints, twist bones among them, into a limb's two segments by their lengths."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["FOREARM_RATIO", "SHIN_RATIO", "ankle_of", "divide_limb", "limb_misfit", "path_below", "toes_by_place"]

FOREARM_RATIO = 0.9  # usual length of the forearm (elbow to wrist) per upper arm
SHIN_RATIO = 1.0  # usual length of the shin per thigh
_ANKLE_TURN = np.radians(35.0)  # smallest angle between shin and foot


def path_below(tree: SourceTree, above: int, joint: int) -> list[int]:
    """Joints from ``above`` (excluded) down to ``joint`` (included)."""
    return [j for j in [joint, *tree.ancestors(joint)][::-1] if j not in (above, *tree.ancestors(above))]


def limb_misfit(
    first: NDArray[np.float64], second: NDArray[np.float64], end: NDArray[np.float64], whole: float, ratio: float
) -> float:
    """|log| of the ratio of lower to upper length, per usual ratio; infinite for degenerate limbs."""
    upper, lower = float(np.linalg.norm(second - first)), float(np.linalg.norm(end - second))
    if min(upper, lower) < 0.05 * whole or upper + lower < 0.7 * whole:
        return np.inf
    return abs(float(np.log(lower / upper / ratio)))


def divide_limb(
    tree: SourceTree, chain: Sequence[int], ratio: float, fixed: Mapping[int, Collection[int]] | None = None
) -> tuple[int, int, float]:
    """The two joints that divide a limb into segments of the usual ratio and nearly its whole length, and the misfit.

    Args:
        tree: The file's joints.
        chain: Joints of the limb, from the trunk to its end (wrist, ankle), at least two.
        ratio: Usual length of the lower segment per that of the upper.
        fixed: 0 (hip, shoulder) or 1 (knee, elbow) → allowed joints; all joints for missing keys.
    """
    at = tree.positions[list(chain)]
    whole = max(float(np.linalg.norm(p - at[-1])) for p in at)
    fixed = fixed or {}
    pairs = [
        (a, b)
        for a in range(len(chain) - 2)
        for b in range(a + 1, len(chain) - 1)
        if chain[a] in fixed.get(0, (chain[a],)) and chain[b] in fixed.get(1, (chain[b],))
    ]
    if not pairs:
        return chain[0], chain[min(1, len(chain) - 1)], np.inf
    first, second = min(pairs, key=lambda pair: limb_misfit(at[pair[0]], at[pair[1]], at[-1], whole, ratio))
    return chain[first], chain[second], limb_misfit(at[first], at[second], at[-1], whole, ratio)


def ankle_of(tree: SourceTree, leg: Sequence[int]) -> int:
    """Index in ``leg`` of the ankle: where toes branch off, or where the chain turns into the foot."""
    if tree.children[leg[-1]] or len(leg) < 4:
        return len(leg) - 1
    bones = np.diff(tree.positions[list(leg)], axis=0)
    bones /= np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-12)
    turns = np.arccos(np.clip((bones[1:] * bones[:-1]).sum(axis=1), -1, 1))
    late = len(turns) // 2
    sharpest = late + int(turns[late:].argmax())
    return sharpest + 1 if turns[sharpest] > _ANKLE_TURN else len(leg) - 1


def toes_by_place(tree: SourceTree, heads: Sequence[int], side: str, outwards: NDArray[np.float64]) -> dict[str, int]:
    """Joints of the toes that start at ``heads``, numbered from the innermost (the big toe).

    Args:
        tree: The file's joints.
        heads: First joint of each toe.
        side: ``left`` or ``right``.
        outwards: Direction from the middle of the body to the foot, shape (3,).
    """
    out: dict[str, int] = {}
    for n, head in enumerate(sorted(heads, key=lambda j: float(outwards @ tree.positions[j])), start=1):
        toe = [head]
        while len(tree.children[toe[-1]]) == 1:
            toe.append(tree.children[toe[-1]][0])
        out |= {f"{side}.toe{n}.{name}": j for name, j in zip(FINGER_JOINTS, toe, strict=False)}
    return out
