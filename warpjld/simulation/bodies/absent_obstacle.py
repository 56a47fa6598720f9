"""An obstacle that does not act during some times, as for a body that falls past it on a path known already."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Ints32
from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Points, checked_points

__all__ = ["AbsentObstacle"]

_FAR = 1e3
"""Distance that points are said to have from what is absent [m]: beyond everything that contact looks for."""


@dataclass(frozen=True, eq=False)
class AbsentObstacle(Obstacle):
    """An obstacle that nothing touches between two times, both excluded.

    Attributes:
        present: The obstacle at all other times.
        begins, ends: Times between which it is absent.
    """

    present: Obstacle
    begins: float
    ends: float

    def project(self, points: Points, time: float) -> ClosestPoints:
        """See `Obstacle.project`."""
        if not self.begins + 1e-9 < time < self.ends - 1e-9:
            return self.present.project(points, time)
        away = np.zeros((len(checked_points(points)), 3))
        away[:, 1] = 1.0
        return ClosestPoints(np.full(len(points), _FAR), points - _FAR * away, away)

    def carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """See `Obstacle.carried`."""
        return self.present.carried(points, time_from, time_to)

    def mesh(self, time: float) -> tuple[Points, Ints32]:
        """See `Obstacle.mesh`."""
        return self.present.mesh(time)
