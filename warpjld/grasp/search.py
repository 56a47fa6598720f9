"""Flexion search: the joint angle at which a chosen vertex of the skin touches an object (A §7.3, R74, R76, C20)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.device import array_on
from warpjld.errors import InputError
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.facet import inside_facets
from warpjld.grasp.objects import Places
from warpjld.grasp.packing import drives_on, posture_on, skin_on
from warpjld.grasp.sampled_search import is_sampled, sampled_search
from warpjld.grasp.search_result import SearchResult, SearchStatus
from warpjld.grasp.searches import Searches, SearchRows, search_rows
from warpjld.runtime.threads import in_threads, threads_for
from warpjld.skeleton import CHANNELS, Poses

__all__ = ["FINEST", "FlexionSearch"]

FINEST = 1e-7
"""Smallest tolerance ε [m] that single precision resolves."""

_SPLIT_BELOW = 500  # searches per thread below which work is not split further


class FlexionSearch:
    """Flexion searches of one surface on a set of objects; keeps the search structures from call to call.

    Args:
        coverings: The covering, or parameter sets of it (``with_parameters``); of the smooth or the paper's method.
        objects: Search structures; the searches run on their device.

    Raises:
        InputError: No covering, or coverings of different surfaces or methods.
    """

    def __init__(self, coverings: Covering | Sequence[Covering], objects: ObjectSet) -> None:
        self.coverings = (coverings,) if isinstance(coverings, Covering) else tuple(coverings)
        if not self.coverings:
            raise InputError("coverings: want at least one")
        self.objects = objects
        self._skin = None if is_sampled(self.coverings) else skin_on(objects.device, self.coverings)

    def run(
        self,
        poses: Poses,
        angles: NDArray[np.float64],
        searches: Searches,
        *,
        places: Places | None = None,
        tolerance: float = 1e-6,
        threads: int | None = None,
    ) -> SearchResult:
        """Run all searches in one launch; the result of each is bit for bit the same in any batch.

        Only the given vertex is deformed (R74). A search moves it by steps bounded by its distance until the distance
        minus the target distance changes sign, from outside in or from inside out; that bracket is bisected until
        |DIST(α) − DIST| < ε. Contacts that last for less than 1/64 of the joint's range and are less than about 1 mm
        deep may be missed.

        Args:
            poses: F poses to start from.
            angles: Joint angles of these poses [rad], shape (F, J, 4).
            searches: The searches.
            places: Placements that ``searches.place`` refers to; by default each object's own.
            tolerance: ε [m].
            threads: CPU threads; by default all cores where there is enough to do.

        Raises:
            InputError: No search, a vertex, joint, frame, object, facet or place that does not exist, joints that do
                not lie one beyond the other, or numbers that are not finite.
        """
        self._check(poses, angles, tolerance)
        skeleton = self.coverings[0].skeleton
        if places is None:
            places = self.objects.places(np.arange(len(self.objects)))
        rows = search_rows(
            searches,
            skeleton,
            angles,
            self.objects.objects,
            vertices=len(self.coverings[0].surface.vertices),
            coverings=len(self.coverings),
            places=len(places),
        )
        if self._skin is None:
            found = sampled_search(self.coverings, self.objects, poses, angles, rows, places, tolerance)
            return replace(found, inside=self._inside(rows, found.point))
        return self._launched(rows, poses, angles, places, tolerance, threads)

    def _launched(
        self,
        rows: SearchRows,
        poses: Poses,
        angles: NDArray[np.float64],
        places: Places,
        tolerance: float,
        threads: int | None,
    ) -> SearchResult:
        import warp as wp
        from warpjld_kernels.flexion_search import search

        device, skeleton = self.objects.device, self.coverings[0].skeleton
        origin = poses.positions[:, 0]
        inputs = [
            self.objects.solids,
            self._skin,
            posture_on(device, skeleton, poses, origin),
            drives_on(device, skeleton, poses, angles, rows.chains),
            *self._tasks(rows, places, origin),
        ]
        kinds = (wp.int32, float, float, wp.int32, wp.vec3, wp.int32)
        outs = [wp.zeros(len(rows), dtype=kind, device=device) for kind in kinds]

        def span(begin: int, end: int) -> None:
            wp.launch(search, dim=end - begin, inputs=[*inputs, tolerance, begin], outputs=outs, device=device)

        if threads is None:
            threads = threads_for(len(rows), _SPLIT_BELOW)
        in_threads(span, len(rows), threads if device.is_cpu else 1, search, device)
        status, closing, distance, facet, point, evaluations = (out.numpy() for out in outs)
        bent = rows.chains[rows.drive].angles(closing.astype(np.float64))
        return SearchResult(status, closing, bent, distance, facet, self._inside(rows, point), point, evaluations)

    def nearest(
        self,
        poses: Poses,
        angles: NDArray[np.float64],
        searches: Searches,
        *,
        places: Places | None = None,
        tolerance: float = 1e-6,
        threads: int | None = None,
    ) -> SearchResult:
        """Search in both directions from the present angles; of two contacts take the nearer one (A §7.3, R142).

        Without a contact in either direction, the closer of the two closest approaches is taken. Arguments as for
        ``run``.

        Raises:
            InputError: As for ``run``, or a ``stop``, which has no meaning here.
        """
        if searches.stop is not None:
            raise InputError("searches: a stop belongs to one direction; a search either way ends at the limits")
        with_rate, against = (
            self.run(poses, angles, replace(searches, rate=rate), places=places, tolerance=tolerance, threads=threads)
            for rate in (np.asarray(searches.rate, dtype=np.float64), -np.asarray(searches.rate, dtype=np.float64))
        )
        wanted = np.broadcast_to(np.asarray(searches.distance, dtype=np.float64), with_rate.distance.shape)
        hits = [found.status == int(SearchStatus.CONVERGED) for found in (with_rate, against)]
        off = [np.abs(found.distance - wanted) for found in (with_rate, against)]
        nearer = with_rate.closing <= against.closing
        first = np.where(hits[0] & hits[1], nearer, np.where(hits[0] | hits[1], hits[0], off[0] <= off[1]))
        return with_rate.where(first, replace(against, closing=-against.closing))

    def _check(self, poses: Poses, angles: NDArray[np.float64], tolerance: float) -> None:
        self.coverings[0].check(poses)
        shape = (len(poses), len(self.coverings[0].skeleton), len(CHANNELS))
        if angles.shape != shape:
            raise InputError(f"angles: want shape {shape}, got {angles.shape}")
        if not np.isfinite(angles).all():
            raise InputError("angles: not finite")
        if not (np.isfinite(tolerance) and tolerance >= FINEST):
            raise InputError(f"tolerance: want {FINEST:g} m or more, which float32 can tell, got {tolerance:g}")

    def _tasks(self, rows: SearchRows, places: Places, origin: NDArray[np.float64]) -> list[Any]:
        """Kernel inputs of the searches; placements relative to the frames' origins (F, 3) [m]."""
        import warp as wp

        device = self.objects.device
        return [
            array_on(device, rows.drive, wp.int32),
            array_on(device, rows.covering * len(self.coverings[0].surface.vertices) + rows.vertex, wp.int32),
            array_on(device, rows.thing, wp.int32),
            array_on(device, rows.facet, wp.int32),
            array_on(device, rows.distance, float),
            array_on(device, places.position[rows.place] - origin[rows.frame], wp.vec3),
            array_on(device, places.rotation[rows.place], wp.quat),
        ]

    def _inside(self, rows: SearchRows, point: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether the foot of the perpendicular lies in the chosen facet, shape (N,); true where none was chosen."""
        inside = np.ones(len(rows), dtype=bool)
        for k, thing in enumerate(self.objects.objects):
            own = np.flatnonzero((rows.thing == k) & (rows.facet >= 0))
            corners = thing.vertices[thing.faces[rows.facet[own]]]
            inside[own] = inside_facets(corners, point[own][:, [0, 2]], slack=float(np.finfo(np.float32).eps))
        return inside
