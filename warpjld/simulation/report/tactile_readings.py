"""What the pads of a hand feel at the frames that were solved (R95, R125)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.results.nodal_contact import Imprint
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.report.tactile import Tactile, tactile_of
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["tactile_readings"]


@dataclass(frozen=True, eq=False)
class _Touch:
    """One pair on the hand's own nodes."""

    name: str
    nodal: NDArray[np.float64]
    imprint: Imprint


@dataclass(frozen=True, eq=False)
class _Instant:
    time: float
    displacement: NDArray[np.float64]
    touches: tuple[_Touch, ...]


def tactile_readings(model: ContactModel, hand: FleshBody, frames: Sequence[SolvedFrame]) -> Tactile:
    """Force, centre, area and slip of every pad of a hand; times are frame numbers.

    Raises:
        InputError: No frame.
    """
    span = model.spans[hand.name]
    mine = [k for k, owner in enumerate(model.owners) if owner.other(hand.name) is not None]
    instants = [
        _Instant(
            frame.frame,
            frame.displacement[span],
            tuple(_Touch(model.pairs[k].title, frame.nodal[k, span], frame.imprint.of((k, span))) for k in mine),
        )
        for frame in frames
    ]
    return tactile_of(hand.hand, instants)
