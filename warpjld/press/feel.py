"""What the pads of a hand feel at the frames that were solved (R95, R125)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.results.nodal_contact import NodalContact
from warpjld.fem.hand.tactile import Tactile, tactile_of
from warpjld.press.bodies import Bodies
from warpjld.press.frames import SolvedFrame
from warpjld.press.hand_body import HandBody

__all__ = ["felt"]


@dataclass(frozen=True, eq=False)
class _Touch:
    """One pair on the hand's own nodes."""

    name: str
    nodal: NDArray[np.float64]
    nodal_contact: NodalContact


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
    mine = [k for k, owner in enumerate(bodies.owners) if hand.name in (owner.slave, owner.master)]
    instants = [
        _Instant(
            frame.frame,
            frame.displacement[span],
            tuple(_Touch(bodies.pairs[k].title, frame.nodal[k, span], frame.nodal_contact.of((k, span))) for k in mine),
        )
        for frame in frames
    ]
    return tactile_of(hand.part.hand, instants)
