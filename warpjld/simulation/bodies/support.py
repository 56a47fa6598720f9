"""What an object stands on until a hand has taken its weight (R123, R128).

The points it stands on hold it while the hand closes. Then they let go: their forces fade, and one point in the
object's middle keeps its height, and nothing else, and so takes over what the hand does not bear yet. That point is
lowered until no force is left on it: the hand alone holds the object, in an equilibrium that was reached with the
descent under control, which finds it also where friction is almost used up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.bodies.deformable_body import Bearing

__all__ = ["ObjectSupport", "handle_of"]

_NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))


@dataclass(frozen=True, eq=False)
class ObjectSupport:
    """An object's support over time.

    Attributes:
        handle: Node in the object's middle.
        axis: Of the weight: 0, 1 or 2.
        begins: Time until which the object stands; infinite: for ever.
        bare: Time at which its points hold it no more.
        free: Time from which on it is free.
        lowered: Displacement of the handle along the axis from ``bare`` to ``free`` [m].
    """

    handle: int
    axis: int
    begins: float = np.inf
    bare: float = np.inf
    free: float = np.inf
    lowered: float = 0.0

    def stands(self, time: float) -> bool:
        """Whether its points hold the object."""
        return time <= self.begins + 1e-9

    def prescribed(self, time: float, bearing: Bearing | None) -> Prescribed:
        """Displacement of the handle, while it holds anything."""
        if self.stands(time) or time >= self.free - 1e-9:
            return _NOTHING
        down = self.lowered * max(0.0, (time - self.bare) / (self.free - self.bare))
        height = 0.0 if bearing is None else bearing.height
        return Prescribed(np.array([3 * self.handle + self.axis]), np.array([height + down]))

    def fading(self, time: float, bearing: Bearing | None) -> NDArray[np.float64] | None:
        """What is left of the forces of its points [N], shape (N, 3)."""
        if bearing is None or self.stands(time) or time >= self.bare:
            return None
        return (self.bare - time) / (self.bare - self.begins) * bearing.forces

    def released(self, begins: float, free: float, lowered: float) -> ObjectSupport:
        """The same, letting go from one time to another, while the object's middle sinks so far [m]."""
        return replace(self, begins=begins, free=free, lowered=lowered, bare=0.5 * (begins + free))

    def bearing(self, time: float, displacement: NDArray[np.float64], reactions: NDArray[np.float64]) -> Bearing | None:
        """What it bears, from the object's rows (N, 3), at the moment it begins to let go; None at others."""
        if abs(time - self.begins) >= 1e-9:
            return None
        return Bearing(reactions.copy(), float(displacement[self.handle, self.axis]))


def handle_of(nodes: NDArray[np.float64]) -> int:
    """The node nearest to the middle of all (N, 3): the weight acts there."""
    return int(np.argmin(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1)))
