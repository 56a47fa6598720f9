"""Distance between thumb and finger pads while a hand closes in the air: the widths that fit between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.digits import digit_chains, pad_vertex
from warpjld.grasp.postures import POSTURES, posture_angles
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.channels import FLEXION

__all__ = ["Opening", "OpeningsOfPostures", "closing_in_air"]

_STEPS = 15  # poses from open to curled
_CURL = {"finger": (50.0, 45.0, 30.0), "thumb": (20.0, 40.0, 45.0)}  # flexion added to the joints, base first [degrees]


@dataclass(frozen=True, eq=False)
class Opening:
    """A closing motion in S steps from an open posture to curled digits, with the root at rest.

    Attributes:
        angles: Joint angles [rad], shape (S, J, 4).
        thumb: Middle of the thumb's pad [m], shape (S, 3).
        fingers: Mean of the pads of index, middle and ring finger, of those that close [m], shape (S, 3).
    """

    angles: NDArray[np.float64]
    thumb: NDArray[np.float64]
    fingers: NDArray[np.float64]

    @property
    def width(self) -> NDArray[np.float64]:
        """Distance between thumb and fingers [m], shape (S,)."""
        return np.asarray(np.linalg.norm(self.fingers - self.thumb, axis=1))

    @property
    def between(self) -> NDArray[np.float64]:
        """Midpoints between thumb and fingers [m], shape (S, 3)."""
        return 0.5 * (self.thumb + self.fingers)

    def step_for(self, width: float) -> int:
        """The last step at which the pads are at least this far apart; 0 where none is."""
        wide = np.flatnonzero(np.minimum.accumulate(self.width) >= width)
        return int(wide[-1]) if len(wide) else 0


class OpeningsOfPostures:
    """Closing motions of a hand from each of ``POSTURES``, which no object changes, computed once."""

    def __init__(self, covering: Covering) -> None:
        self._covering = covering
        self._kept: dict[tuple[str, ...], list[Opening]] = {}

    def of(self, side: str, digits: Sequence[str]) -> list[Opening]:
        """One for each posture, by these digits; arguments as for ``closing_in_air``."""
        key = (side, *digits)
        if key not in self._kept:
            starts = np.array([posture_angles(self._covering.skeleton, side, posture) for posture in POSTURES])
            self._kept[key] = closing_in_air(self._covering, side, starts, digits)
        return self._kept[key]


def closing_in_air(covering: Covering, side: str, starts: NDArray[np.float64], digits: Sequence[str]) -> list[Opening]:
    """Closing motions from open postures, one for each.

    Args:
        covering: The hand.
        side: ``left`` or ``right``.
        starts: Angles of N open hands [rad], shape (N, J, 4).
        digits: Names of the digits that close, without side.
    """
    skeleton = covering.skeleton
    angles = np.repeat(starts[:, None], _STEPS, axis=1)
    share = np.linspace(0.0, 1.0, _STEPS)
    for digit in digits:
        (chain,) = digit_chains(skeleton, [f"{side}.{digit}"]).values()
        for joint, curl in zip(chain, _CURL["thumb" if digit == "thumb" else "finger"], strict=True):
            bent = starts[:, None, joint, FLEXION] + share * np.radians(curl)
            angles[:, :, joint, FLEXION] = np.clip(bent, *skeleton.limits[joint, FLEXION])
    opposed = [digit for digit in ("index", "middle", "ring") if digit in digits]
    pads = np.array([pad_vertex(covering, f"{side}.{digit}") for digit in ("thumb", *opposed)], dtype=np.int32)
    poses = poses_from_angles(skeleton, angles.reshape(-1, *angles.shape[2:]))
    points = covering.points(poses, pads).astype(np.float64).reshape(len(starts), _STEPS, len(pads), 3)
    return [Opening(own, at[:, 0], at[:, 1:].mean(axis=1)) for own, at in zip(angles, points, strict=True)]
