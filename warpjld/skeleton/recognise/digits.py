"""From the joints of one digit, in order, to its canonical joints, whatever a convention leaves out or adds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.hand import FINGER_JOINTS

__all__ = ["assign_digit"]

# distance from the wrist to a chain's first joint, per length of its first bone: about 0.7 where that bone is a
# metacarpal, about 2 where it is the first phalanx (WebXR, Anny, MANO)
_METACARPAL_RATIO = 1.3


def assign_digit(
    digit: str,
    joints: Sequence[int],
    ranks: Sequence[int | None],
    positions: NDArray[np.float64],
    wrist: NDArray[np.float64] | None,
) -> dict[str, int]:
    """Canonical joints of one digit.

    Args:
        digit: ``thumb``, ``index``, …
        joints: Its joints from the root outwards.
        ranks: What names say of each: 0 metacarpal … 4 tip, or None.
        positions: Positions of all joints of the file, shape (N, 3).
        wrist: Position of the wrist, where there is one.

    Returns:
        Canonical names without the side → joints; fewer than five where the file has fewer.
    """
    chain, marks = list(joints), list(ranks)
    roles: dict[str, int] = {}
    size = float(np.linalg.norm(np.ptp(positions[chain], axis=0))) or 1.0
    while len(chain) > 3 and np.linalg.norm(positions[chain[1]] - positions[chain[0]]) < 1e-3 * size:
        chain, marks = chain[1:], marks[1:]  # Leap's thumb has a metacarpal of no length
    if len(chain) > 1 and marks[-1] == 4:
        roles[f"{digit}.tip"] = chain.pop()
        marks.pop()
    if digit == "thumb":
        names = ["thumb.base", "thumb.knuckle2", "thumb.knuckle3"]
        if len(chain) > 3 and "thumb.tip" in roles:
            chain = chain[-3:]  # a trapezium comes first
        names.append("thumb.tip")
    else:
        if len(chain) > 1 and (marks[0] == 0 or _starts_with_metacarpal(chain, positions, wrist, roles, digit)):
            roles[f"{digit}.carpometacarpal"] = chain.pop(0)
        names = [f"{digit}.{joint}" for joint in FINGER_JOINTS]
    for name, joint in zip(names, chain, strict=False):
        roles.setdefault(name, joint)
    return roles


def _starts_with_metacarpal(
    chain: list[int],
    positions: NDArray[np.float64],
    wrist: NDArray[np.float64] | None,
    roles: dict[str, int],
    digit: str,
) -> bool:
    if len(chain) >= 5 or (len(chain) == 4 and f"{digit}.tip" in roles):
        return True
    if len(chain) < 4 or wrist is None:
        return False
    first = np.linalg.norm(positions[chain[1]] - positions[chain[0]])
    return bool(np.linalg.norm(positions[chain[0]] - wrist) < _METACARPAL_RATIO * first)
