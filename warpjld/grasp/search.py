"""Semi-automatic flexion: the angle at which a chosen point of the skin touches an object (A §7.3, R74, R76, C20)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.device import array_on
from warpjld.errors import InputError
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.facet import inside_facets
from warpjld.grasp.found import Found
from warpjld.grasp.objects import Places
from warpjld.grasp.packing import drives_on, posture_on, skin_on
from warpjld.grasp.searches import Rows, Searches, search_rows
from warpjld.skeleton import CHANNELS, Poses
from warpjld.threads import in_threads, threads_for

__all__ = ["FINEST", "FlexionSearch"]

FINEST = 1e-7
"""Smallest tolerance ε [m], which single precision can tell."""

_SPLIT_BELOW = 500  # searches a thread must have before splitting pays


class FlexionSearch:
    """Searches for one surface among some objects; keeps what does not change from call to call.

    Args:
        coverings: The covering, or parameter sets of it (``with_parameters``); the smooth method.
        objects: Search structures; the searches run on their device.

    Raises:
        InputError: No covering, one of another method, or coverings of different surfaces.
    """

    def __init__(self, coverings: Covering | Sequence[Covering], objects: ObjectSet) -> None:
        self.coverings = (coverings,) if isinstance(coverings, Covering) else tuple(coverings)
        if not self.coverings:
            raise InputError("coverings: want at least one")
        self.objects = objects
        self._skin = skin_on(objects.device, self.coverings)

    def run(
        self,
        poses: Poses,
        angles: NDArray[np.float64],
        searches: Searches,
        *,
        places: Places | None = None,
        tolerance: float = 1e-6,
        threads: int | None = None,
    ) -> Found:
        """All searches in one launch; each gives bit for bit what it gives alone.

        Only the vertex asked for is mapped (R74). A search moves the vertex by steps no longer than its distance
        allows until the distance, less the one asked for, changes its sign; that bracket is halved until
        |DIST(α) − DIST| < ε. Contacts that last for less than a 64th of the joint's range and go less than
        about a millimetre deep may be missed.

        Args:
            poses: F poses to start from.
            angles: Joint angles of these poses [rad], shape (F, J, 4).
            searches: What to search for.
            places: Placements that ``searches.place`` counts; by default each object's own.
            tolerance: ε [m].
            threads: CPU threads; by default all cores where there is enough to do.

        Raises:
            InputError: No search, a vertex, joint, frame, object, facet or place that does not exist, joints that do
                not lie one beyond the other, or numbers that are not finite.
        """
        import warp as wp
        from warpjld_kernels.flexion_search import search

        self._check(poses, angles, tolerance)
        device, skeleton = self.objects.device, self.coverings[0].skeleton
        if places is None:
            places = self.objects.places(np.arange(len(self.objects)))
        rows = search_rows(
            searches,
            skeleton,
            angles,
            self.objects.objects,
            vertices=self._skin.vertices,
            coverings=len(self.coverings),
            places=len(places),
        )
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
        return Found(status, closing, bent, distance, facet, self._inside(rows, point), point, evaluations)

    def _check(self, poses: Poses, angles: NDArray[np.float64], tolerance: float) -> None:
        self.coverings[0].check(poses)
        shape = (len(poses), len(self.coverings[0].skeleton), len(CHANNELS))
        if angles.shape != shape:
            raise InputError(f"angles: want shape {shape}, got {angles.shape}")
        if not np.isfinite(angles).all():
            raise InputError("angles: not finite")
        if not (np.isfinite(tolerance) and tolerance >= FINEST):
            raise InputError(f"tolerance: want {FINEST:g} m or more, which float32 can tell, got {tolerance:g}")

    def _tasks(self, rows: Rows, places: Places, origin: NDArray[np.float64]) -> list[Any]:
        """What each search looks for, on the device; places relative to the frames' origins (F, 3)."""
        import warp as wp

        device = self.objects.device
        return [
            array_on(device, rows.drive, wp.int32),
            array_on(device, rows.covering * self._skin.vertices + rows.vertex, wp.int32),
            array_on(device, rows.thing, wp.int32),
            array_on(device, rows.facet, wp.int32),
            array_on(device, rows.distance, float),
            array_on(device, places.position[rows.place] - origin[rows.frame], wp.vec3),
            array_on(device, places.rotation[rows.place], wp.quat),
        ]

    def _inside(self, rows: Rows, point: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether the foot of the perpendicular lies in the facet that was asked for, shape (N,)."""
        inside = np.ones(len(rows), dtype=bool)
        for k, thing in enumerate(self.objects.objects):
            own = np.flatnonzero((rows.thing == k) & (rows.facet >= 0))
            corners = thing.vertices[thing.faces[rows.facet[own]]]
            inside[own] = inside_facets(corners, point[own][:, [0, 2]], slack=float(np.finfo(np.float32).eps))
        return inside
