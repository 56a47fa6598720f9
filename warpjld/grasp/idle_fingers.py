"""Fingers of a grasp that touch nothing follow the finger beside them that does.

A finger that misses the object would close into a fist beside it, and one that takes no part in a posture would stay
straight. Fingers of people do neither: their flexors move neighbours along (enslaving; Zatsiorsky, Li and Latash 2000,
Exp Brain Res 131: 187–195), and a finger without a task follows the one beside it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.channels import FLEXION

__all__ = ["idle_fingers_relaxed"]

_FINGERS = ("index", "middle", "ring", "pinky")


def idle_fingers_relaxed(
    angles: NDArray[np.float64],
    chains: Mapping[str, tuple[int, ...]],
    touching: Collection[str],
    closing: Collection[str],
    share: float,
) -> NDArray[np.float64]:
    """Joint angles with idle fingers bent by the nearest finger that touches.

    No joint of an idle finger that closes is flexed farther than that of the other finger; those of one that takes no
    part are flexed by a share of it, if that is farther than they are.

    Args:
        angles: Angles of a closed hand [rad], shape (J, 4).
        chains: Joints of its digits, base first, see ``digit_chains``.
        touching: Names of the digits that touch.
        closing: Names of the digits that take part.
        share: Flexion of one that does not, over that of the finger beside it.

    Returns:
        Angles [rad], shape (J, 4); as given where no finger touches.
    """
    out = angles.copy()
    place = {name: _FINGERS.index(short) for name in chains if (short := name.rpartition(".")[2]) in _FINGERS}
    busy = [name for name in place if name in touching]
    for name in place.keys() - set(busy):
        if not busy:
            break
        beside = min(busy, key=lambda other: (abs(place[other] - place[name]), place[other]))
        mine, theirs = list(chains[name]), list(chains[beside])
        own, other = angles[mine, FLEXION], angles[theirs, FLEXION]
        out[mine, FLEXION] = np.minimum(own, other) if name in closing else np.maximum(own, share * other)
    return out
