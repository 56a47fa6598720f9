"""Results and statuses of flexion searches (C20)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

__all__ = ["SearchResult", "SearchStatus"]


class SearchStatus(IntEnum):
    """Status of a search; docs/reference/statuses.md explains each. ``message`` is a readable text."""

    CONVERGED = 0
    NO_CONTACT = 1
    INSIDE = 2
    AT_LIMIT = 3
    OPENING = 4
    BLOCKED = 5

    @property
    def message(self) -> str:
        """Readable text of the status."""
        return (
            "converged",
            "no contact within the joint's limits",
            "inside the object, and not out of it within the joint's limits",
            "the joint is at its limit",
            "slips through an opening of the object's surface",
            "stopped by another digit or the palm",
        )[self]


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Results of N searches, in their order.

    Attributes:
        status: Values of ``SearchStatus``, shape (N,).
        closing: Closing of the chain [rad at rate 1], shape (N,), negative where ``FlexionSearch.nearest`` found the
            contact in the other direction; at the closest approach where there is no contact.
        angles: Flexion of the joints at that closing [rad], shape (N, 4); for a single joint the first column.
        distance: Signed distance at that closing [m], shape (N,); the residual is this minus the target distance.
        facet: Triangle touched or nearest, a row of the object's faces, shape (N,); ``thing.facet_of`` gives the
            file's own number.
        inside: Whether the foot of the perpendicular lies in the facet (C19), shape (N,); true for ``NEAREST``.
        point: Nearest point in the object's frame, or position in the chosen facet's basis [m], shape (N, 3).
        evaluations: How often the vertex was deformed, shape (N,).
    """

    status: NDArray[np.int32]
    closing: NDArray[np.float32]
    angles: NDArray[np.float64]
    distance: NDArray[np.float32]
    facet: NDArray[np.int32]
    inside: NDArray[np.bool_]
    point: NDArray[np.float32]
    evaluations: NDArray[np.int32]

    def where(self, first: NDArray[np.bool_], other: SearchResult) -> SearchResult:
        """Row-wise choice between two results of the same searches: these where ``first`` (N,), else ``other``."""
        pick = {}
        for field in fields(self):
            own, its = getattr(self, field.name), getattr(other, field.name)
            pick[field.name] = np.where(first.reshape(-1, *[1] * (own.ndim - 1)), own, its)
        return SearchResult(**pick)

    def message(self, n: int = 0) -> str:
        """Readable text about search ``n``: its status with angle and distance."""
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
