"""Limits of the closing motion: digits neither pass through the object nor end with its edges deep in their skin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["give_way"]

_WAY = (0.25, 0.5, 0.75, 0.9)  # fractions of the closing motion at which digits must not be in the object
_HALVINGS = 7  # bisection steps: the motion is limited to within 1/128


def give_way(
    depths: Callable[[NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]],
    parts: Sequence[str],
    start: NDArray[np.float64],
    closed: NDArray[np.float64],
    chains: Mapping[str, tuple[int, ...]],
    *,
    allowed: float,
    on_the_way: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Open digits that the object penetrates, as far as necessary and at most to their open angles.

    All joints of a digit move together, linearly from open (0) to closed (1). A digit is stopped where its final depth
    is allowed, and before the first sampled fraction at which it would pass through the object.

    Args:
        depths: Function from hands (n,) and joint angles (n, J, 4) to penetration depths by part [m], (n, parts).
        parts: Names of these parts.
        start: Angles of the open hands [rad], shape (G, J, 4).
        closed: Angles of the closed hands [rad], shape (G, J, 4).
        chains: Joints of D digits, see ``digit_chains``.
        allowed: Largest depth at the end [m].
        on_the_way: Depth above which a digit counts as passing through the object [m].

    Returns:
        Angles [rad], shape (G, J, 4), and the fraction of the closing motion of every digit, shape (G, D).
    """
    digits = [d for d, digit in enumerate(chains) if digit in parts]
    columns = [parts.index(digit) for digit in chains if digit in parts]
    joints = [list(chain) for chain in chains.values()]

    def angles_at(rows: NDArray[np.int64], gone: NDArray[np.float64]) -> NDArray[np.float64]:
        out = start[rows]
        for own, part in zip(joints, gone.T, strict=True):
            way = closed[rows][:, own] - start[rows][:, own]
            out[:, own] = start[rows][:, own] + part[:, None, None] * way
        return out

    hands = np.arange(len(start))
    high = np.ones((len(hands), len(joints)))
    way = np.repeat(_WAY, len(hands))
    rows = np.tile(hands, len(_WAY))
    passing = depths(rows, angles_at(rows, np.repeat(way[:, None], len(joints), axis=1)))[:, columns] > on_the_way
    for part, through in zip(_WAY, passing.reshape(len(_WAY), len(hands), -1), strict=True):
        high[:, digits] = np.where(through, np.minimum(high[:, digits], part), high[:, digits])
    cut = np.zeros(high.shape, dtype=bool)
    cut[:, digits] = depths(hands, angles_at(hands, high))[:, columns] > allowed
    low = np.where(cut, 0.0, high)
    limited = np.flatnonzero(cut.any(axis=1))
    for _ in range(_HALVINGS if len(limited) else 0):
        middle = 0.5 * (low[limited] + high[limited])
        deep = np.zeros(middle.shape, dtype=bool)
        deep[:, digits] = depths(limited, angles_at(limited, middle))[:, columns] > allowed
        low[limited], high[limited] = np.where(deep, low[limited], middle), np.where(deep, middle, high[limited])
    return angles_at(hands, low), low
