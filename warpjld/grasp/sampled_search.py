"""Flexion search by sampling, for coverings without a search kernel: the paper's own operators (A §7.3, R76).

Finds what the kernel finds: the first change of sign of the distance along the chain's motion, else the closest
approach. An interval is sampled in one batch, and the subinterval with the change of sign is sampled again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.paper import PaperCovering
from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, multiply
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.facet import facet_distance
from warpjld.grasp.objects import Places
from warpjld.grasp.packing import Chains
from warpjld.grasp.search_result import SearchResult, SearchStatus
from warpjld.grasp.searches import SearchRows
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.channels import FLEXION

__all__ = ["is_sampled", "sampled_search"]

_STEPS = 64  # samples of the whole motion
_PARTS = 16  # samples of an interval that is refined
_NARROWEST = 1e-7  # smallest interval of closing [rad at rate 1]; float32 vertex positions resolve no less
_CLOSEST = 1e-5  # interval of closing to which the closest approach is refined [rad at rate 1]


def is_sampled(coverings: Sequence[Covering]) -> bool:
    """Whether these coverings (of the paper's method) need the search by sampling.

    Raises:
        InputError: Coverings of different methods, surfaces or skeletons.
    """
    first = coverings[0]
    kinds = {isinstance(covering, PaperCovering) for covering in coverings}
    if len(kinds) > 1:
        raise InputError("coverings: want one method, smooth or paper, for all")
    if any(c.skeleton is not first.skeleton or len(c.anchors) != len(first.anchors) for c in coverings):
        raise InputError("coverings: want parameter sets of one surface on one skeleton (with_parameters)")
    return kinds == {True}


def sampled_search(
    coverings: Sequence[Covering],
    objects: ObjectSet,
    poses: Poses,
    angles: NDArray[np.float64],
    rows: SearchRows,
    places: Places,
    tolerance: float,
) -> SearchResult:
    """Results of searches, computed one after another; arguments as for ``FlexionSearch.run``."""
    ended = [
        _Search(coverings[rows.covering[k]], objects, poses, angles, rows, places, k).run(tolerance)
        for k in range(len(rows))
    ]
    closing = np.array([end.closing for end in ended], dtype=np.float32)
    return SearchResult(
        status=np.array([end.status for end in ended], dtype=np.int32),
        closing=closing,
        angles=rows.chains[rows.drive].angles(closing.astype(np.float64)),
        distance=np.array([end.distance for end in ended], dtype=np.float32),
        facet=np.array([end.facet for end in ended], dtype=np.int32),
        inside=np.ones(len(ended), dtype=bool),
        point=np.array([end.point for end in ended], dtype=np.float32),
        evaluations=np.array([end.evaluations for end in ended], dtype=np.int32),
    )


@dataclass(frozen=True, eq=False)
class _End:
    """Result of one search."""

    status: SearchStatus
    closing: float
    distance: float
    facet: int
    point: NDArray[np.float64]
    evaluations: int


class _Search:
    """One search: a row of ``SearchRows``."""

    def __init__(
        self,
        covering: Covering,
        objects: ObjectSet,
        poses: Poses,
        angles: NDArray[np.float64],
        rows: SearchRows,
        places: Places,
        number: int,
    ) -> None:
        self._covering, self._objects = covering, objects
        self._vertex, self._thing = int(rows.vertex[number]), int(rows.thing[number])
        self._facet, self._target = int(rows.facet[number]), float(rows.distance[number])
        self._place = places[np.array([rows.place[number]])]
        self._chain: Chains = rows.chains[rows.drive[number : number + 1]]
        frame = int(rows.frame[number])
        self._angles = angles[frame]
        still = poses_from_angles(covering.skeleton, self._angles[None])
        self._turn = multiply(poses.rotations[frame, :1], conjugate(still.rotations[0, :1]))
        self._shift = poses.positions[frame, :1] - covering.skeleton.rest[:1]
        self._seen = 0

    def run(self, tolerance: float) -> _End:
        reach = float(self._chain.reach[0])
        (start,) = self._gaps(np.zeros(1))
        side = -1.0 if start < 0.0 else 1.0
        if abs(start) < tolerance:
            return self._end(SearchStatus.CONVERGED, 0.0)
        if reach < 1e-6:
            return self._end(SearchStatus.AT_LIMIT if side > 0.0 else SearchStatus.INSIDE, 0.0)
        at = np.linspace(0.0, reach, _STEPS + 1)
        gaps = side * self._gaps(at)
        closest = at[0]
        while True:
            good = np.abs(gaps) < tolerance
            past = good | (gaps < 0.0)
            if past.any():
                first = int(past.argmax())
                if good[first]:
                    return self._end(SearchStatus.CONVERGED, at[first])
                if at[first] - at[first - 1] < _NARROWEST:
                    return self._end(SearchStatus.OPENING, at[first])
                span = at[first - 1], at[first]
            else:
                least = int(gaps.argmin())
                closest = at[least]
                span = at[max(least - 1, 0)], at[min(least + 1, len(at) - 1)]
                if span[1] - span[0] < _CLOSEST:
                    return self._end(SearchStatus.NO_CONTACT if side > 0.0 else SearchStatus.INSIDE, closest)
            at = np.linspace(*span, _PARTS + 1)
            gaps = side * self._gaps(at)

    def _points(self, closings: NDArray[np.float64]) -> NDArray[np.float32]:
        """World positions of the vertex at closings (n,) [m], shape (n, 3)."""
        count = len(closings)
        posed = np.repeat(self._angles[None], count, axis=0)
        for k, joint in enumerate(self._chain.joints[0].tolist()):
            if joint >= 0:
                own = self._chain[np.zeros(count, dtype=np.int64)].angles(closings)
                posed[:, joint, FLEXION] = own[:, k]
        poses = poses_from_angles(
            self._covering.skeleton,
            posed,
            root_position=np.repeat(self._shift, count, axis=0),
            root_rotation=np.repeat(self._turn, count, axis=0),
        )
        return self._covering.points(poses, [self._vertex])[:, 0]

    def _gaps(self, closings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed distances minus the target distance [m], shape (n,)."""
        self._seen += len(closings)
        return np.array([d for d, _, _ in self._hits(closings)]) - self._target

    def _hits(self, closings: NDArray[np.float64]) -> list[tuple[float, int, NDArray[np.float64]]]:
        """Distance, facet, and nearest point in the object's frame (or position in the basis of a chosen facet)."""
        points = self._points(closings)
        if self._facet >= 0:
            at = facet_distance(points, self._objects.objects[self._thing], self._facet, self._place)
            return [(float(p[1]), self._facet, p) for p in at.coordinates]
        found = self._objects.distances(points, which=self._thing, places=self._place, nearest=True)
        assert found.point is not None
        own = self._place.to_local(found.point[0])[0]
        return [(float(d), int(f), p) for d, f, p in zip(found.distance[0], found.face[0], own, strict=True)]

    def _end(self, status: SearchStatus, closing: float) -> _End:
        # evaluated at the closing rounded to float32, which is the closing that is returned
        ((distance, facet, point),) = self._hits(np.array([float(np.float32(closing))]))
        return _End(status, float(closing), distance, facet, point, self._seen)
