"""Points within balls, found by a grid of cells: SciPy's trees take longer to import than small surfaces to bind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["within_balls"]

_TOGETHER = 2_000_000  # candidates examined at once, which bounds memory
_ACROSS = 16  # most cells along a ball's radius, which bounds how many lines of them it crosses
_CELLS = 1 << 20  # most cells along an axis, so that a cell's number has 60 bits


def within_balls(
    points: NDArray[np.float64], centres: NDArray[np.float64], radii: NDArray[np.float64], most: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of balls and points in them, ball by ball.

    Args:
        points: Points [m], shape (P, 3).
        centres: Centres of the balls [m], shape (B, 3).
        radii: Their radii [m], shape (B,).
        most: Largest number of pairs: balls after the one that would exceed it have none.

    Returns:
        Balls, ascending, and points, shape (pairs,) each.
    """
    low = points.min(axis=0)
    size = float(np.ptp(points, axis=0).max())
    cell = max(float(np.median(radii)), float(radii.max()) / _ACROSS, size / (_CELLS - 1), 1e-300)
    place = np.clip((points - low) / cell, 0, _CELLS - 1).astype(np.int64)
    number = (place[:, 0] * _CELLS + place[:, 1]) * _CELLS + place[:, 2]
    order = np.argsort(number, kind="stable")
    number, sorted_points = number[order], points[order]
    ball, begin, length = _lines_of_cells(number, (centres - low) / cell, radii / cell)
    found: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = [(ball[:0], order[:0])]
    left, first = most, 0
    through = np.cumsum(length)
    while first < len(ball) and left > 0:
        # whole balls at a time
        done = int(through[first - 1]) if first else 0
        last = max(int(np.searchsorted(through, done + _TOGETHER, side="right")), first + 1)
        last = int(np.searchsorted(ball, ball[last - 1], side="right"))
        some = slice(first, last)
        of = np.repeat(ball[some], length[some])
        before = np.cumsum(length[some]) - length[some]
        at = np.arange(len(of)) + np.repeat(begin[some] - before, length[some])
        inside = ((sorted_points[at] - centres[of]) ** 2).sum(axis=1) <= radii[of] ** 2
        of, at = of[inside], at[inside]
        kept = np.cumsum(np.bincount(of)) <= left
        if not kept.all():  # this ball and those after it are too many
            of, at = of[kept[of]], at[kept[of]]
            left = 0
        left -= len(of)
        found.append((of, order[at]))
        first = last
    balls, near = zip(*found, strict=True)
    return np.concatenate(balls), np.concatenate(near)


def _lines_of_cells(
    number: NDArray[np.int64], centres: NDArray[np.float64], radii: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Lines of cells along z that the balls' boxes contain, in units of the cells: ball, first point and number of
    points of each that is not empty; balls ascend."""
    box = [np.clip(np.floor(centres + sign * radii[:, None]), -1, _CELLS).astype(np.int64) for sign in (-1, 1)]
    box = [np.clip(corner, 0, _CELLS - 1) for corner in box]
    across = box[1][:, :2] - box[0][:, :2] + 1
    lines = across.prod(axis=1)
    ball = np.repeat(np.arange(len(centres)), lines)
    within = np.arange(len(ball)) - np.repeat(np.cumsum(lines) - lines, lines)
    x, y = (box[0][ball, k] + part for k, part in enumerate(np.divmod(within, across[ball, 1])))
    line = (x * _CELLS + y) * _CELLS
    begin = np.searchsorted(number, line + box[0][ball, 2], side="left")
    end = np.searchsorted(number, line + box[1][ball, 2], side="right")
    full = end > begin
    return ball[full], begin[full], (end - begin)[full]
