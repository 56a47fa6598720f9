"""What the pads of a hand feel at the frames that were solved (R95, R125)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.tactile import Tactile, tactile_of
from warpjld.press.bodies import Bodies
from warpjld.press.frames import SolvedFrame
from warpjld.press.hand_body import HandBody

__all__ = ["felt"]


@dataclass(frozen=True, eq=False)
class _Touch:
    """One pair, its nodes numbered as the hand's own; nodes of others get a number beyond."""

    name: str
    nodes: NDArray[np.int32]
    pressure: NDArray[np.float64]
    area: NDArray[np.float64]
    slip: NDArray[np.float64]
    sticking: NDArray[np.bool_]
    nodal: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Instant:
    time: float
    displacement: NDArray[np.float64]
    touches: tuple[_Touch, ...]


def felt(bodies: Bodies, hand: HandBody, frames: Sequence[SolvedFrame]) -> Tactile:
    """Force, centre, area and slip of every pad of a hand; times are frame numbers.

    Raises:
        InputError: No frame.
    """
    span = bodies.spans[hand.name]
    count = span.stop - span.start
    instants = []
    for frame in frames:
        all_ = frame.touching
        touches = []
        for k, owner in enumerate(bodies.owners):
            if hand.name not in (owner.slave, owner.master):
                continue
            mine = all_.pair == k
            nodes = all_.node[mine]
            own = (nodes >= span.start) & (nodes < span.stop)
            touches.append(
                _Touch(
                    bodies.pairs[k].title,
                    np.where(own, nodes - span.start, count).astype(np.int32),
                    all_.pressure[mine],
                    all_.area[mine],
                    all_.slip[mine],
                    ~all_.slides[mine],
                    frame.nodal[k][span],
                )
            )
        instants.append(_Instant(frame.frame, frame.displacement[span], tuple(touches)))
    return tactile_of(hand.part.hand, instants)
