"""Obstacles: objects beside the one that is grasped, which no part of a hand may enter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.objects import GraspObject

__all__ = ["COLLIDES", "Obstacles"]

COLLIDES = 1e-4
"""Penetration depth above which a hand collides with an object [m]."""

_COARSE = 4  # the fast test looks at every fourth vertex


class Obstacles:
    """Collision tests of a hand with obstacles; false (``bool``) if there are none.

    Args:
        covering: The hand.
        things: The obstacles at their own placements.
    """

    def __init__(self, covering: Covering, things: Sequence[GraspObject]) -> None:
        self.names = tuple(thing.name for thing in things)
        self._objects = ObjectSet(things) if things else None
        self._both = [HandObjectGaps(covering, thing) for thing in things]

    def __bool__(self) -> bool:
        return bool(self.names)

    def missed(self, skins: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Fast test of deformed skins (S, V, 3) [m]: mask of those with no tested vertex in an obstacle, shape (S,)."""
        if self._objects is None or not len(skins):
            return np.ones(len(skins), dtype=bool)
        sets, which = (rows.ravel() for rows in np.indices((len(skins), len(self.names))))
        found = self._objects.distances(skins[:, ::_COARSE], which=which, sets=sets)
        nearest = found.distance.min(axis=1).reshape(len(skins), -1)
        return np.asarray(nearest.min(axis=1) > -COLLIDES)

    def depth(self, skins: NDArray[np.floating]) -> float:
        """Largest penetration depth of any of the hands and any obstacle [m], measured in both directions; 0 for none.

        Args:
            skins: Deformed skins [m], shape (S, V, 3).
        """
        return max((float(both.depths(skins).max()) for both in self._both), default=0.0)
