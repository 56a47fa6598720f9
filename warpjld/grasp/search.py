"""Semi-automatic flexion: the angle at which a chosen point of the skin touches an object (A §7.3, R74, R76, C20)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.distance import ObjectSet, in_threads
from warpjld.grasp.objects import Places
from warpjld.grasp.packing import Chains, drives_on, posture_on, skin_on
from warpjld.skeleton import CHANNELS, Poses

__all__ = ["FINEST", "NEAREST", "FlexionSearch", "Found", "Searches", "Status"]

NEAREST = -1
"""In place of a facet's number: whatever facet is nearest."""

FINEST = 1e-7
"""Smallest tolerance ε [m]."""

_FLEXION = CHANNELS.index("flexion")
_SPLIT_BELOW = 500  # searches a thread must have before splitting pays


class Status(IntEnum):
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
            "already inside the object",
            "the joint is at its limit",
            "slips in through an opening of the object's surface",
            "stopped by another digit or the palm",
        )[self]


@dataclass(frozen=True, eq=False)
class Searches:
    """What to search for; every field is one value or one for each of N searches.

    Attributes:
        vertex: Vertex of the surface that is to touch.
        joint: Joint that bends; or, shape (N, up to 4), joints that bend together, each beyond the one before.
        frame: Pose it starts from.
        covering: Parameter set.
        thing: Object.
        facet: Facet of the object whose plane is to be touched (R73), or ``NEAREST``.
        distance: Distance to stop at [m] (the paper's DIST).
        place: Row of the places given with the search.
        rate: Turn of each joint for a closing of one; 1 bends, -1 stretches. Shape (N, up to 4) for several joints.
        stop: Flexion at which each joint stays [rad]; by default its limit in the direction of its rate.
    """

    vertex: ArrayLike
    joint: ArrayLike
    frame: ArrayLike = 0
    covering: ArrayLike = 0
    thing: ArrayLike = 0
    facet: ArrayLike = NEAREST
    distance: ArrayLike = 0.0
    place: ArrayLike | None = None
    rate: ArrayLike = 1.0
    stop: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Found:
    """Results of N searches, in their order.

    Attributes:
        status: Values of ``Status``, shape (N,).
        closing: How far the chain closed [rad at rate 1], shape (N,); the closest approach where there is no contact.
        angles: Flexion of the joints there [rad], shape (N, 4); for a single joint the first column.
        distance: Signed distance there [m], shape (N,): the true residual is this less the distance asked for.
        facet: Facet touched or nearest, shape (N,).
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

    def message(self, n: int = 0) -> str:
        """What became of a search, for people."""
        status = Status(int(self.status[n]))
        angle, distance = np.degrees(self.angles[n, 0]), 1e3 * float(self.distance[n])
        if status is Status.CONVERGED:
            aside = "" if self.inside[n] else ", beside the facet: its plane is touched, not the facet itself"
            return f"{status.message} at {angle:.2f}°{aside}"
        if status is Status.NO_CONTACT:
            return f"{status.message}; closest approach {distance:.2f} mm at {angle:.2f}°"
        if status is Status.INSIDE:
            return f"{status.message} by {-distance:.2f} mm at {angle:.2f}°"
        if status is Status.OPENING:
            return f"{status.message} at {angle:.2f}°"
        return f"{status.message}, {angle:.2f}°; {distance:.2f} mm away"


class FlexionSearch:
    """Searches for one surface among some objects; keeps what does not change from call to call.

    Args:
        coverings: The covering, or parameter sets of it (``with_parameters``); the smooth method.
        objects: Objects, or their search structures.
        device: Warp device.
    """

    def __init__(self, coverings: Covering | Sequence[Covering], objects: ObjectSet, *, device: str = "cpu") -> None:
        self.coverings = (coverings,) if isinstance(coverings, Covering) else tuple(coverings)
        if not self.coverings:
            raise InputError("coverings: want at least one")
        self.objects = objects
        if str(objects.device) != device and device != "cpu":
            raise InputError(f"device: the objects are on {objects.device}, not on {device}")
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
            InputError: A vertex, joint, frame, object, facet or place that does not exist, or numbers that are not
                finite.
        """
        import warp as wp
        from warpjld_kernels.flexion_search import search

        self.coverings[0].check(poses)
        table, chains = self._table(poses, angles, searches, places, tolerance)
        count, device = len(table["vertex"]), self.objects.device
        origin = poses.positions[:, 0]
        skeleton = self.coverings[0].skeleton
        if places is None:
            own = [self.objects.objects[k].place for k in range(len(self.objects))]
            places = Places(np.concatenate([p.position for p in own]), np.concatenate([p.rotation for p in own]))
        model = [
            self.objects.solids,
            self._skin,
            posture_on(device, skeleton, poses, origin),
            drives_on(device, skeleton, poses, angles, chains),
        ]
        tasks = [
            (table["drive"], wp.int32),
            (table["covering"] * self._skin.vertices + table["vertex"], wp.int32),
            (table["thing"], wp.int32),
            (table["facet"], wp.int32),
            (table["distance"], float),
            (places.position[table["place"]] - origin[table["frame"]], wp.vec3),
            (places.rotation[table["place"]], wp.quat),
        ]
        inputs = [
            wp.array(np.ascontiguousarray(v, np.int32 if k is wp.int32 else np.float32), dtype=k, device=device)
            for v, k in tasks
        ]
        kinds = (wp.int32, float, float, wp.int32, wp.vec3, wp.int32)
        outs = [wp.zeros(count, dtype=kind, device=device) for kind in kinds]

        def span(begin: int, end: int) -> None:
            wp.launch(
                search,
                dim=end - begin,
                inputs=[*model, *inputs, tolerance, begin],
                outputs=outs,
                device=device,
            )

        if threads is None:
            threads = min(os.cpu_count() or 1, max(1, count // _SPLIT_BELOW))
        in_threads(span, count, threads if device.is_cpu else 1, search, device)
        status, closing, distance, face, point, evaluations = (out.numpy() for out in outs)
        there = Chains(
            *(a[table["drive"]] for a in (chains.frame, chains.joints, chains.rates, chains.stops, chains.starts))
        )
        inside = self._inside(table, point)
        return Found(status, closing, there.angles(closing.astype(float)), distance, face, inside, point, evaluations)

    def _table(
        self, poses: Poses, angles: NDArray[np.float64], searches: Searches, places: Places | None, tolerance: float
    ) -> tuple[dict[str, NDArray], Chains]:
        """One row per search, checked; and the chains they use, each once."""
        skeleton = self.coverings[0].skeleton
        if angles.shape != (len(poses), len(skeleton), len(CHANNELS)):
            raise InputError(f"angles: want shape ({len(poses)}, {len(skeleton)}, {len(CHANNELS)}), got {angles.shape}")
        if not np.isfinite(angles).all():
            raise InputError("angles: not finite")
        if not (np.isfinite(tolerance) and tolerance >= FINEST):
            raise InputError(f"tolerance: want {FINEST:g} m or more, which float32 can tell, got {tolerance:g}")
        single = {
            "vertex": searches.vertex,
            "frame": searches.frame,
            "covering": searches.covering,
            "thing": searches.thing,
            "facet": searches.facet,
            "distance": searches.distance,
            "place": searches.thing if searches.place is None else searches.place,
        }
        joints, rates, stops = self._chain_columns(searches)
        try:
            count = np.broadcast_shapes(*(np.shape(v) for v in single.values()), (len(joints),), (1,))[0]
        except ValueError:
            raise InputError("searches: every field wants one value or one for each search") from None
        table = {
            name: np.broadcast_to(np.asarray(v, dtype=np.float64 if name == "distance" else np.int64), count)
            for name, v in single.items()
        }
        things = self.objects.objects
        facets = np.array([len(thing.faces) for thing in things])
        rows = len(things) if places is None else len(places)
        vertices = len(self.coverings[0].surface.vertices)
        for name, size in (
            ("vertex", vertices),
            ("frame", len(poses)),
            ("covering", len(self.coverings)),
            ("thing", len(things)),
            ("place", rows),
        ):
            bad = (table[name] < 0) | (table[name] >= size)
            if bad.any():
                raise InputError(f"searches: {name} must lie in 0…{size - 1}, got {table[name][bad][0]}")
        bad = (table["facet"] < NEAREST) | (table["facet"] >= facets[table["thing"]])
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            thing = things[table["thing"][row]]
            raise InputError(f"object {thing.name} has facets 0 to {len(thing.faces) - 1}, got {table['facet'][row]}")
        if not np.isfinite(table["distance"]).all():
            raise InputError("searches: distance is not finite")
        joints, rates, stops = (np.broadcast_to(a, (count, 4)) for a in (joints, rates, stops))
        first, table["drive"] = _distinct([table["frame"], *joints.T, *rates.T, *np.nan_to_num(stops, nan=1e9).T])
        frame, joints, rates, stops = table["frame"][first], joints[first], rates[first], stops[first]
        used = np.where(joints >= 0, joints, 0)
        starts = angles[frame[:, None], used, _FLEXION]
        low, high = np.moveaxis(skeleton.limits[used, _FLEXION], -1, 0)
        stops = np.where(np.isnan(stops), np.where(rates > 0.0, high, low), stops)
        # a joint that begins beyond its limit stays where it is
        stops = np.where(rates > 0.0, np.maximum(stops, starts), np.minimum(stops, starts))
        return table, Chains(frame.astype(np.int32), joints.astype(np.int32), rates, stops, starts)

    def _chain_columns(self, searches: Searches) -> tuple[NDArray, NDArray, NDArray]:
        skeleton = self.coverings[0].skeleton
        joints = np.asarray(searches.joint, dtype=np.int64)
        joints = joints.reshape(-1, 1) if joints.ndim < 2 else joints
        if joints.ndim != 2 or not 1 <= joints.shape[1] <= 4:
            raise InputError(f"searches: joint wants shape (N,) or (N, up to 4), got {joints.shape}")
        if joints.max() >= len(skeleton) or joints.min() < -1 or joints[:, 0].min() < 0:
            raise InputError(f"searches: joint must lie in 0…{len(skeleton) - 1}")
        rate = np.asarray(searches.rate, dtype=np.float64)
        stop = np.asarray(np.nan if searches.stop is None else searches.stop, dtype=np.float64)
        if not np.isfinite(rate).all() or np.isinf(stop).any():
            raise InputError("searches: rate and stop must be finite")
        if joints.shape[1] == 1:
            rate, stop = (v.reshape(-1, 1) if v.ndim == 1 else v for v in (rate, stop))
        try:
            shape = np.broadcast_shapes(joints.shape, rate.shape, stop.shape)
        except ValueError:
            raise InputError(f"searches: rate and stop want the shape of joint, {joints.shape}") from None
        fill = ((0, 0), (0, 4 - joints.shape[1]))
        chains = np.pad(np.broadcast_to(joints, shape), fill, constant_values=-1)
        rates = np.pad(np.broadcast_to(rate, shape), fill)
        return (
            chains,
            np.where(chains >= 0, rates, 0.0),
            np.pad(np.broadcast_to(stop, shape), fill, constant_values=np.nan),
        )

    def _inside(self, table: dict[str, NDArray], point: NDArray[np.float32]) -> NDArray[np.bool_]:
        inside = np.ones(len(point), dtype=bool)
        chosen = np.flatnonzero(table["facet"] >= 0)
        if not len(chosen):
            return inside
        things, facets = table["thing"][chosen], table["facet"][chosen]
        corner = np.empty((len(chosen), 3, 3))
        for k in np.unique(things):
            thing = self.objects.objects[k]
            corner[things == k] = thing.vertices[thing.faces[facets[things == k]]]
        x = corner[:, 1] - corner[:, 0]
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        y = np.cross(x, corner[:, 2] - corner[:, 0])
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        z = np.cross(x, y)
        away = corner - corner[:, :1]
        flat = np.stack([np.einsum("nki,ni->nk", away, x), np.einsum("nki,ni->nk", away, z)], axis=-1)
        foot = point[chosen][:, [0, 2]].astype(np.float64)
        within = np.ones(len(chosen), dtype=bool)
        for k in range(3):
            side, to = flat[:, (k + 1) % 3] - flat[:, k], foot - flat[:, k]
            within &= -(side[:, 0] * to[:, 1] - side[:, 1] * to[:, 0]) >= -1e-9 * np.abs(flat).max()
        inside[chosen] = within
        return inside


def _distinct(columns: Sequence[NDArray]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First rows of all different rows of a table given by columns, and every row's number among them."""
    code = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        if (column != column[0]).any():
            values, place = np.unique(column, return_inverse=True)
            code = np.unique(code * len(values) + place, return_inverse=True)[1]
    _, first, number = np.unique(code, return_index=True, return_inverse=True)
    return first, number
