"""What flexion searches ended with, in numbers and in words (C20)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

__all__ = ["Found", "SearchStatus"]


class SearchStatus(IntEnum):
    """How a search ended; ``message`` is for people."""

    CONVERGED = 0
    NO_CONTACT = 1
    INSIDE = 2
    AT_LIMIT = 3
    OPENING = 4
    BLOCKED = 5

    @property
    def message(self) -> str:
        """In words."""
        return (
            "converged",
            "no contact within the joint's limits",
            "inside the object, and not out of it within the joint's limits",
            "the joint is at its limit",
            "slips through an opening of the object's surface",
            "stopped by another digit or the palm",
        )[self]


@dataclass(frozen=True, eq=False)
class Found:
    """Results of N searches, in their order.

    Attributes:
        status: Values of ``Status``, shape (N,).
        closing: How far the chain closed [rad at rate 1], shape (N,), negative where ``FlexionSearch.nearest`` turned
            it the other way; the closest approach where there is no contact.
        angles: Flexion of the joints there [rad], shape (N, 4); for a single joint the first column.
        distance: Signed distance there [m], shape (N,): the true residual is this less the distance asked for.
        facet: Triangle touched or nearest, a row of the object's faces, shape (N,); ``thing.facet_of`` has the file's
            own number.
        inside: Whether the foot of the perpendicular lies in the facet (C19), shape (N,); true for ``NEAREST``.
        point: Nearest point in the object's frame, or the place in the chosen facet's basis [m], shape (N, 3).
        evaluations: Mappings of the vertex, shape (N,).
    """

    status: NDArray[np.int32]
    closing: NDArray[np.float32]
    angles: NDArray[np.float64]
    distance: NDArray[np.float32]
    facet: NDArray[np.int32]
    inside: NDArray[np.bool_]
    point: NDArray[np.float32]
    evaluations: NDArray[np.int32]

    def where(self, first: NDArray[np.bool_], other: Found) -> Found:
        """These results, and in the rows that are not chosen those of others of the same searches."""
        pick = {}
        for field in fields(self):
            own, its = getattr(self, field.name), getattr(other, field.name)
            pick[field.name] = np.where(first.reshape(-1, *[1] * (own.ndim - 1)), own, its)
        return Found(**pick)

    def message(self, n: int = 0) -> str:
        """What became of a search, for people."""
        status = SearchStatus(int(self.status[n]))
        angle, distance = np.degrees(self.angles[n, 0]), 1e3 * float(self.distance[n])
        if status is SearchStatus.CONVERGED:
            aside = "" if self.inside[n] else ", beside the facet: its plane is touched, not the facet itself"
            return f"{status.message} at {angle:.2f}°{aside}"
        if status is SearchStatus.NO_CONTACT:
            return f"{status.message}; closest approach {distance:.2f} mm at {angle:.2f}°"
        if status is SearchStatus.INSIDE:
            return f"{status.message}; least deep, {-distance:.2f} mm, at {angle:.2f}°"
        if status is SearchStatus.OPENING:
            return f"{status.message} at {angle:.2f}°"
        return f"{status.message}, {angle:.2f}°; {distance:.2f} mm away"
