"""Support of an object until a hand has taken its weight (R123, R128).

Support points hold the object while the hand closes. On release their reactions are ramped down, while the height of
one central node (the handle) is prescribed and takes the part of the weight that the hand does not bear yet. The handle
is lowered until its reaction vanishes: then the hand alone holds the object. This displacement control reaches the
equilibrium also where friction is almost exhausted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.bodies.deformable_body import Bearing

__all__ = ["ObjectSupport", "handle_of"]

_NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))
"""No Dirichlet conditions."""


@dataclass(frozen=True, eq=False)
class ObjectSupport:
    """Support of an object and its release over time.

    Attributes:
        handle: Central node of the object.
        axis: Axis of gravity: 0, 1 or 2.
        begins: Time at which the release begins; infinite: never.
        bare: Time at which the reactions of the support points have faded to zero.
        free: Time from which on the handle is free as well.
        lowered: Displacement of the handle along the axis from ``bare`` to ``free`` [m].
    """

    handle: int
    axis: int
    begins: float = np.inf
    bare: float = np.inf
    free: float = np.inf
    lowered: float = 0.0

    def stands(self, time: float) -> bool:
        """Whether the support points still hold the object."""
        return time <= self.begins + 1e-9

    def prescribed(self, time: float, bearing: Bearing | None) -> Prescribed:
        """Prescribed height of the handle during the release; empty before and after."""
        if self.stands(time) or time >= self.free - 1e-9:
            return _NOTHING
        down = self.lowered * max(0.0, (time - self.bare) / (self.free - self.bare))
        height = 0.0 if bearing is None else bearing.height
        return Prescribed(np.array([3 * self.handle + self.axis]), np.array([height + down]))

    def fading(self, time: float, bearing: Bearing | None) -> NDArray[np.float64] | None:
        """Remaining forces of the support points during the release [N], shape (N, 3); None before and after."""
        if bearing is None or self.stands(time) or time >= self.bare:
            return None
        return (self.bare - time) / (self.bare - self.begins) * bearing.forces

    def released(self, begins: float, free: float, lowered: float) -> ObjectSupport:
        """A copy with a release between two times, during which the handle moves by ``lowered`` [m]."""
        return replace(self, begins=begins, free=free, lowered=lowered, bare=0.5 * (begins + free))

    def bearing(self, time: float, displacement: NDArray[np.float64], reactions: NDArray[np.float64]) -> Bearing | None:
        """Support reactions, from the object's rows (N, 3), at the time the release begins; None at other times."""
        if abs(time - self.begins) >= 1e-9:
            return None
        return Bearing(reactions.copy(), float(displacement[self.handle, self.axis]))


def handle_of(nodes: NDArray[np.float64]) -> int:
    """Index of the node nearest to the mean of all nodes (N, 3)."""
    return int(np.argmin(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1)))
