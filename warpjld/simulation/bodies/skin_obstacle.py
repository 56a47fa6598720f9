"""Actor without simulated flesh as a prescribed obstacle (R94, R126)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from warpjld.fem.arrays import Ints32
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Obstacle, Points, checked_points
from warpjld.simulation.animation import ActorAnimation

__all__ = ["SkinObstacle", "bystanders"]


class SkinObstacle(Obstacle):
    """Surface of an actor deformed by its covering, as an obstacle; times are in frames from ``start``."""

    def __init__(self, actor: ActorAnimation, start: float) -> None:
        self._actor, self._start = actor, start
        self._shape = lru_cache(maxsize=8)(self._covered)
        self._facets = Facets(self._shape(0.0), actor.covering.surface.faces)
        self._now = 0.0

    def project(self, points: Points, time: float) -> ClosestPoints:
        """See `Obstacle.project`."""
        return self._at(time).project(checked_points(points))

    def carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """See `Obstacle.carried`; points move along with their nearest facets."""
        if time_from == time_to or not len(points):
            return checked_points(points)
        return self._at(time_from).carried(checked_points(points), self._shape(time_to))

    def mesh(self, time: float) -> tuple[Points, Ints32]:
        """See `Obstacle.mesh`."""
        return self._shape(time), self._facets.faces

    def _covered(self, time: float) -> Points:
        return np.asarray(self._actor.skin(self._start + time), np.float64)

    def _at(self, time: float) -> Facets:
        if time != self._now:
            self._facets.move(self._shape(time))
            self._now = time
        return self._facets


def bystanders(
    actors: dict[str, ActorAnimation], fleshed: set[str], frames: list[float], free: bool, start: float
) -> dict[str, Obstacle]:
    """Obstacles by name for actors without flesh that may come into contact.

    Args:
        actors: All actors by name.
        fleshed: Names of those with deformable flesh.
        frames: Frames at which bounding boxes are compared.
        free: Whether there are deformable objects; these may go anywhere, so all actors count.
        start: Frame of time 0.
    """
    out: dict[str, Obstacle] = {}
    for name, actor in actors.items():
        if name not in fleshed and (free or any(_meets(actor, actors[other], frames) for other in sorted(fleshed))):
            out[name] = SkinObstacle(actor, start)
    return out


def _meets(one: ActorAnimation, other: ActorAnimation, frames: list[float]) -> bool:
    """Whether the bounding boxes of two actors over all frames overlap."""
    boxes = []
    for actor in (one, other):
        skins = [actor.skin(frame) for frame in frames]
        boxes.append((np.min([s.min(axis=0) for s in skins], axis=0), np.max([s.max(axis=0) for s in skins], axis=0)))
    (low, high), (least, most) = boxes
    return bool((low < most).all() and (least < high).all())
