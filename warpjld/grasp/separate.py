"""Digits that close do not pass through one another or the palm."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.skeleton import Poses

__all__ = ["keep_apart"]

_WAY = np.array([0.35, 0.7, 1.0])  # parts of the way at which crossings are looked for
_HALVINGS = 6


def keep_apart(
    covering: Covering,
    poses: Callable[[NDArray[np.float64]], Poses],
    start: NDArray[np.float64],
    closed: NDArray[np.float64],
    chains: Mapping[str, tuple[int, ...]],
) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Close all digits at once, each only as far as its skin crosses no other digit's and not the palm's.

    Triangles of different parts are tested for crossing at the end of the way and at places on it. Of two digits that
    cross one is stopped where it is clear of all others: a thumb rather than a finger, since thumbs close last. What
    crosses already at the start does not count.

    Args:
        covering: The hand.
        poses: Poses of joint angles (n, J, 4).
        start: Angles of the open hand, shape (J, 4).
        closed: Angles wanted, shape (J, 4).
        chains: Joints of the digits, see ``digit_chains``.

    Returns:
        Angles, shape (J, 4), and the part of their way that digits went which were stopped.
    """
    parts = surface_parts(covering)
    order = sorted((d for d in chains if d in parts.names), key=lambda digit: digit.endswith("thumb"))
    label = {digit: parts.names.index(digit) for digit in order}

    def angles_at(way: NDArray[np.float64], gone: Mapping[str, float]) -> NDArray[np.float64]:
        out = np.repeat(start[None], len(way), axis=0)
        for digit in order:
            joints = list(chains[digit])
            reached = np.minimum(way, gone[digit])[:, None, None]
            out[:, joints] = start[joints] + reached * (closed[joints] - start[joints])
        return out

    def crossings(way: NDArray[np.float64], gone: Mapping[str, float]) -> NDArray[np.int64]:
        """Crossing pairs of triangles between parts, shape (n, parts, parts)."""
        out = np.zeros((len(way), len(parts.names), len(parts.names)), dtype=np.int64)
        for n, vertices in enumerate(covering.deform(poses(angles_at(way, gone)))):
            pairs = parts.of_face[crossing_faces(vertices, covering.surface.faces).contact(parts).pairs]
            np.add.at(out[n], (pairs[:, 0], pairs[:, 1]), 1)
        return out + out.transpose(0, 2, 1)

    gone = dict.fromkeys(order, 1.0)
    before = crossings(np.zeros(1), gone)
    for _ in order:
        worse = np.asarray((crossings(_WAY, gone) > before).any(axis=0))
        crossing = [digit for digit in order if worse[label[digit]].any()]
        if not crossing:
            break
        digit = crossing[-1]
        low, high = 0.0, gone[digit]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            now = crossings(_WAY, gone | {digit: middle})
            if (now[:, label[digit]] > before[:, label[digit]]).any():
                high = middle
            else:
                low = middle
        gone[digit] = low
    return angles_at(np.ones(1), gone)[0], {digit: part for digit, part in gone.items() if part < 1.0}
