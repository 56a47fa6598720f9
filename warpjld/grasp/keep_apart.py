"""Separation of closing digits: no digit passes through another or through the palm."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["keep_apart"]

_WAY = np.array([0.35, 0.7, 1.0])  # fractions of the closing motion at which crossings are looked for
_HALVINGS = 6  # bisection steps: the motion is limited to within 1/64


def keep_apart(
    skin: PosedSkins,
    deformed: Callable[[NDArray[np.int64], NDArray[np.float64]], NDArray[np.floating]],
    start: NDArray[np.float64],
    closed: NDArray[np.float64],
    chains: Mapping[str, tuple[int, ...]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Close all digits of G hands together, each only as far as its skin crosses neither another digit nor the palm.

    Intersections of triangles of different parts are counted at three fractions of the closing motion. Of two digits
    that cross, one is stopped where it is clear of all others: the thumb rather than a finger, and else the later one
    in the order of ``chains``. Crossings of the open hand do not count.

    Args:
        skin: The hand's skin.
        deformed: Function from hands (n,) and joint angles (n, J, 4) to skins [m], shape (n, V, 3).
        start: Angles of the open hands [rad], shape (G, J, 4).
        closed: Wanted angles [rad], shape (G, J, 4).
        chains: Joints of D digits, see ``digit_chains``.

    Returns:
        Angles [rad], shape (G, J, 4), and the fraction of the closing motion of every digit, shape (G, D).
    """
    names = skin.parts.names
    digits = np.array([d for d, digit in enumerate(chains) if digit in names], dtype=np.int64)
    thumbs = np.array([list(chains)[d].endswith("thumb") for d in digits], dtype=bool)
    order = np.concatenate([digits[~thumbs], digits[thumbs]])
    label = np.array([names.index(list(chains)[d]) for d in order], dtype=np.int32)
    joints = [list(chain) for chain in chains.values()]

    def skins(rows: NDArray[np.int64], way: NDArray[np.float64], gone: NDArray[np.float64]) -> NDArray[np.floating]:
        return deformed(rows, angles_at(rows, np.minimum(way[:, None], gone)))

    def angles_at(rows: NDArray[np.int64], gone: NDArray[np.float64]) -> NDArray[np.float64]:
        out = start[rows]
        for own, part in zip(joints, gone.T, strict=True):
            out[:, own] += part[:, None, None] * (closed[rows][:, own] - start[rows][:, own])
        return out

    hands = np.arange(len(start))
    gone = np.ones((len(hands), len(joints)))
    if not len(order):
        return angles_at(hands, gone), gone
    before = skin.crossings(skins(hands, np.zeros(len(hands)), gone))
    going = hands
    for _ in order:
        rows, way = np.repeat(going, len(_WAY)), np.tile(_WAY, len(going))
        more = skin.cross_more(skins(rows, way, gone[rows]), before[rows])
        worse = np.asarray(more.any(axis=2)).reshape(len(going), len(_WAY), len(names))[:, :, label]
        crossing = np.asarray(worse.any(axis=1))
        affected = np.asarray(crossing.any(axis=1))
        going, worse, crossing = going[affected], worse[affected], crossing[affected]
        if not len(going):
            break
        last = len(order) - 1 - crossing[:, ::-1].argmax(axis=1)
        digit, own = order[last], label[last]
        there = worse[np.arange(len(going)), :, last]  # fractions at which the digit crosses if it is not stopped
        low, high = np.zeros(len(going)), gone[going, digit]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            # fractions that the digit reaches before it is stopped need no new test
            passed = middle[:, None] >= _WAY
            crosses = (there & passed).any(axis=1)
            asked, place = np.nonzero(~passed & ~crosses[:, None])
            if len(asked):
                wanted = gone[going[asked]]
                wanted[np.arange(len(asked)), digit[asked]] = middle[asked]
                posed = skins(going[asked], _WAY[place], wanted)
                more = skin.part_crosses_more(posed, own[asked], before[going[asked], own[asked]])
                np.logical_or.at(crosses, asked, more)
            low, high = np.where(crosses, low, middle), np.where(crosses, middle, high)
        gone[going, digit] = low
    return angles_at(hands, gone), gone
