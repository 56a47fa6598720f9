"""Support of an object until a hand has taken its weight (R123, R128).

Support points hold the object until the hand begins to close on it. From then on it is free to ride along: its weight
is borne, and a viscous medium around it resists motion, which leaves no force once nothing moves. When the hand has
closed, the weight is handed over; at the end the medium goes, and the hand alone holds the object.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["ObjectSupport", "handle_of"]

_FADED = 0.01
"""Viscosity at the end over that while the hand closes: it goes as the object comes to rest, so that hardly anything
has to move once it is gone; searches reduce it likewise."""
_HANDED_OVER = 0.25
"""Fraction of the time between the hand's closing and the end in which the weight is handed over."""


@dataclass(frozen=True, eq=False)
class ObjectSupport:
    """Support of an object and its release over time.

    Attributes:
        axis: Axis of gravity: 0, 1 or 2.
        begins: Time from which on the object rides along; infinite: never.
        over: Time from which on its weight is handed over.
        free: Time from which on the hand alone holds it.
        drag: Viscosity of the medium for the whole object while the hand closes [N × frame / m].
    """

    axis: int
    begins: float = np.inf
    over: float = np.inf
    free: float = np.inf
    drag: float = 0.0

    def stands(self, time: float) -> bool:
        """Whether the support points still hold the object."""
        return time <= self.begins + 1e-9

    def resistance(self, time: float) -> float:
        """Viscosity of the medium at a time [N × frame / m]; 0 before and after."""
        if self.stands(time) or time >= self.free - 1e-9:
            return 0.0
        return float(self.drag * _FADED ** max(0.0, (time - self.over) / (self.free - self.over)))

    def borne(self, time: float) -> float:
        """Share of the weight that is borne while the object rides along; 0 before and after."""
        if self.stands(time) or time >= self.free - 1e-9:
            return 0.0
        end = self.over + _HANDED_OVER * (self.free - self.over)
        return float(np.clip((end - time) / (end - self.over), 0.0, 1.0))

    def released(self, begins: float, over: float, free: float, drag: float) -> ObjectSupport:
        """A copy that is released at these times."""
        return replace(self, begins=begins, over=over, free=free, drag=drag)


def handle_of(nodes: NDArray[np.float64]) -> int:
    """Index of the node nearest to the mean of all nodes (N, 3)."""
    return int(np.argmin(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1)))
