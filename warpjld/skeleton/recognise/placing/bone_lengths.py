"""Which joint of a hand's fingers, displaced along its finger, explains unusual lengths of their bones (R14).

The lengths of the same bones in all fingers follow an additive model: with the mean lengths ``u[d, k]`` of digit d's
bone k (Buryanov, Kotiuk 2010), a hand's are ``u[d, k] · (a[k] + b[d])``, where rigs differ in where they put a row of
joints (a) and in how long each finger is (b). A joint displaced by s along its finger lengthens the bone before it and
shortens the one behind, which no a and b explain: ``s`` is fitted with them by least squares, for each joint in turn,
and the joint is taken that leaves the smallest residual. A displaced wrist changes the first bones of all fingers by
its components along them, and is fitted in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["MEAN_LENGTHS", "Displaced", "displaced_joints"]

Array = NDArray[np.float64]

MEAN_LENGTHS = {
    "index": (98.0, 39.8, 22.4, 15.0),
    "middle": (95.0, 44.6, 26.3, 16.5),
    "ring": (89.0, 41.4, 25.7, 16.5),
    "pinky": (84.0, 32.7, 18.1, 14.5),
}
"""Mean distance from the wrist to the base, and lengths of the phalanges to the tip's centre [mm]."""
_WRIST = 0.5
"""Mean square that a displaced wrist leaves, per that of the best joint, below which it is the wrist: a displaced base
leaves more than 0.7 to the wrist in existing rigs."""
_ALIKE = 0.65
"""Share of what the best joint explains from which another of the same finger is a rival: rigs' own deviations, of up
to 4 mm, can shift a displacement of 8 mm from one joint to the next so far."""


@dataclass(frozen=True)
class Displaced:
    """A finger of which one joint is displaced along it.

    Attributes:
        finger: An index into the chains.
        by: Joints that may be the one, the likeliest first: 0 for the base, 1 for the second joint, 2 for the third →
            displacement towards the tip [m].
    """

    finger: int
    by: dict[int, float]


def displaced_joints(chains: Array, means: Array, smallest: Array) -> list[Displaced]:
    """Joints of fingers that are displaced along them, the one that explains most first.

    Args:
        chains: Wrist, base, second, third joint and tip of each finger [m], shape (D, 5, 3), D ≥ 3.
        means: Mean lengths of their bones in any unit, shape (D, 4).
        smallest: Smallest displacement that is reported, of base, second and third joint [m], shape (D, 3). One beside
            others must explain as much as if it were the only one.
    """
    bones = np.diff(chains, axis=1)
    lengths = np.linalg.norm(bones, axis=2)
    if not lengths.min() > 0.0:
        return []
    ways = bones / lengths[..., None]
    known, wrist = _rows_and_columns(means), _first_bones(-ways[:, 0])
    shifts = {(d, k): _shift(ways, d, k) for d in range(len(chains)) for k in range(3)}
    needed = {joint: smallest[joint] ** 2 * _beside(known, shift)[1] for joint, shift in shifts.items()}
    out: list[Displaced] = []
    while len(out) < len(chains):
        fitted = {joint: _fitted(lengths.ravel(), known, shift) for joint, shift in shifts.items()}
        best = max(fitted, key=lambda joint: fitted[joint][1])
        likely = [j for j in fitted if j[0] == best[0] and fitted[j][1] > _ALIKE * fitted[best][1]]
        if not any(fitted[joint][1] > needed[joint] for joint in likely):
            break
        most = _WRIST * _left(lengths.ravel(), known, shifts[best])
        if (best[0], 0) in shifts and _left(lengths.ravel(), known, wrist) < most:
            # the wrist is elsewhere, which says nothing of the bases
            known, shifts = np.concatenate([known, wrist], axis=1), {j: s for j, s in shifts.items() if j[1] > 0}
            continue
        likely.sort(key=lambda joint: -fitted[joint][1])
        out.append(Displaced(best[0], {joint[1]: fitted[joint][0] for joint in likely}))
        known = np.concatenate([known, shifts.pop(best)[:, None]], axis=1)
    return out


def _rows_and_columns(means: Array) -> Array:
    """Columns of the additive model: factors of the bones of each row of joints and of each finger, (4 D, 4 + D)."""
    rows = means[:, :, None] * np.eye(4)[None]
    fingers = means[:, :, None] * np.eye(len(means))[:, None]
    return np.concatenate([rows, fingers], axis=2).reshape(means.size, -1)


def _first_bones(ways: Array) -> Array:
    """Changes of the first bones with three coordinates of the wrist, shape (4 D, 3)."""
    out = np.zeros((len(ways), 4, 3))
    out[:, 0] = ways
    return out.reshape(-1, 3)


def _shift(ways: Array, finger: int, joint: int) -> Array:
    """Change of all bones per displacement of one joint along the bone behind it, shape (4 D,)."""
    out = np.zeros(ways.shape[:2])
    out[finger, joint] = ways[finger, joint] @ ways[finger, joint + 1]
    out[finger, joint + 1] = -1.0
    return out.ravel()


def _beside(known: Array, shift: Array) -> tuple[Array, float]:
    """What known columns do not explain of another, shape (4 D,), and its sum of squares."""
    left = shift - known @ np.linalg.lstsq(known, shift, rcond=1e-9)[0]
    return left, float(left @ left)


def _fitted(lengths: Array, known: Array, shift: Array) -> tuple[float, float]:
    """Displacement [m] fitted beside the known columns, and the sum of squares that it explains [m²]."""
    own, size = _beside(known, shift)
    if size < 1e-6:
        return 0.0, 0.0
    by = float(own @ lengths) / size
    return by, by * by * size


def _left(lengths: Array, known: Array, more: Array) -> float:
    """Mean square that the known and more columns leave, per degree of freedom [m²]."""
    columns = np.concatenate([known, more.reshape(len(known), -1)], axis=1)
    fit, _, rank, _ = np.linalg.lstsq(columns, lengths, rcond=1e-9)
    return float(((lengths - columns @ fit) ** 2).sum()) / max(len(lengths) - int(rank), 1)
