"""Specification of flexion searches, validated and expanded to one row per search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.packing import Chains
from warpjld.skeleton import Skeleton
from warpjld.skeleton.channels import FLEXION

__all__ = ["NEAREST", "SearchRows", "Searches", "search_rows"]

NEAREST = -1
"""Facet number that means: the nearest facet, whichever it is."""

_MOST_JOINTS = 4  # of a chain in the kernels


@dataclass(frozen=True, eq=False)
class Searches:
    """N flexion searches; every field is one value for all or one for each.

    Attributes:
        vertex: Vertex of the surface that is to touch, a row; ``surface.weld`` converts the file's vertex numbers.
        joint: Joint that flexes; or, shape (N, up to 4), joints that flex together, each beyond the one before.
        frame: Number of the pose to start from.
        covering: Number of the parameter set.
        thing: Number of the object.
        facet: Triangle of the object whose plane is to be touched (R73), or ``NEAREST``; ``thing.triangles_of``
            converts the file's facet numbers.
        distance: Target distance [m] (the paper's DIST).
        place: Row of the placements given with the search; by default the object's number.
        rate: Rotation of each joint per unit of closing; 1 flexes, -1 extends. Shape (N, up to 4) for several joints.
        stop: Flexion at which each joint stops [rad]; by default its limit in the direction of its rate.
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
class SearchRows:
    """N searches, one per row: the validated fields of ``Searches``, each of shape (N,).

    ``drive`` is the row of ``chains`` that a search moves; equal chains of the same frame are shared.
    """

    vertex: NDArray[np.int64]
    frame: NDArray[np.int64]
    covering: NDArray[np.int64]
    thing: NDArray[np.int64]
    facet: NDArray[np.int64]
    place: NDArray[np.int64]
    distance: NDArray[np.float64]
    drive: NDArray[np.int64]
    chains: Chains

    def __len__(self) -> int:
        return len(self.vertex)


def search_rows(
    searches: Searches,
    skeleton: Skeleton,
    angles: NDArray[np.float64],
    things: Sequence[GraspObject],
    *,
    vertices: int,
    coverings: int,
    places: int,
) -> SearchRows:
    """Validate searches and expand them to one row each.

    Args:
        searches: The searches.
        skeleton: Skeleton with J joints.
        angles: Joint angles of F frames [rad], shape (F, J, 4).
        things: The objects.
        vertices: Number of vertices of the surface.
        coverings: Number of parameter sets.
        places: Number of placements.

    Raises:
        InputError: No search, fields whose shapes do not fit, indices out of range, or numbers that are not finite.
    """
    fields = {
        "vertex": searches.vertex,
        "frame": searches.frame,
        "covering": searches.covering,
        "thing": searches.thing,
        "facet": searches.facet,
        "place": searches.thing if searches.place is None else searches.place,
    }
    joints, rates, stops = _chain_columns(searches, len(skeleton))
    try:
        shapes = [np.shape(v) for v in (*fields.values(), searches.distance)]
        (count,) = np.broadcast_shapes(*shapes, (len(joints),), (1,))
    except ValueError:
        raise InputError("searches: every field needs one value or one for each search") from None
    if not count:
        raise InputError("searches: want at least one")
    columns = {name: np.broadcast_to(np.asarray(v, dtype=np.int64), count) for name, v in fields.items()}
    distance = np.broadcast_to(np.asarray(searches.distance, dtype=np.float64), count)
    there = {"vertex": vertices, "frame": len(angles), "covering": coverings, "thing": len(things), "place": places}
    for name, size in there.items():
        bad = (columns[name] < 0) | (columns[name] >= size)
        if bad.any():
            raise InputError(f"searches: {name} must lie in 0…{size - 1}, got {columns[name][bad][0]}")
    facets = np.array([len(thing.faces) for thing in things])
    bad = (columns["facet"] < NEAREST) | (columns["facet"] >= facets[columns["thing"]])
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        things[columns["thing"][row]].check_facet(columns["facet"][row])
    if not np.isfinite(distance).all():
        raise InputError("searches: distance is not finite")
    joints, rates, stops = (np.broadcast_to(a, (count, _MOST_JOINTS)) for a in (joints, rates, stops))
    first, drive = _distinct([columns["frame"], *joints.T, *rates.T, *np.nan_to_num(stops, nan=1e9).T])
    chains = _chains(skeleton, angles, columns["frame"][first], joints[first], rates[first], stops[first])
    return SearchRows(**columns, distance=distance, drive=drive, chains=chains)


def _chain_columns(searches: Searches, joint_count: int) -> tuple[NDArray, NDArray, NDArray]:
    """Joints, rates and stops, each (1 or N, 4), padded with -1, 0 and NaN where there are fewer joints."""
    joints = np.asarray(searches.joint, dtype=np.int64)
    joints = joints.reshape(-1, 1) if joints.ndim < 2 else joints
    if joints.ndim != 2 or not joints.size or joints.shape[1] > _MOST_JOINTS:
        raise InputError(f"searches: joint needs shape (N,) or (N, up to {_MOST_JOINTS}), got {joints.shape}")
    if joints.max() >= joint_count or joints.min() < -1 or joints[:, 0].min() < 0:
        raise InputError(f"searches: joint must lie in 0…{joint_count - 1}")
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
    fill = ((0, 0), (0, _MOST_JOINTS - joints.shape[1]))
    chains = np.pad(np.broadcast_to(joints, shape), fill, constant_values=-1)
    rates = np.where(chains >= 0, np.pad(np.broadcast_to(rate, shape), fill), 0.0)
    return chains, rates, np.pad(np.broadcast_to(stop, shape), fill, constant_values=np.nan)


def _chains(
    skeleton: Skeleton,
    angles: NDArray[np.float64],
    frame: NDArray[np.int64],
    joints: NDArray[np.int64],
    rates: NDArray[np.float64],
    stops: NDArray[np.float64],
) -> Chains:
    """Chains with their start angles, and with the joints' limits where no stop is given."""
    used = np.where(joints >= 0, joints, 0)
    starts = angles[frame[:, None], used, FLEXION]
    low, high = np.moveaxis(skeleton.limits[used, FLEXION], -1, 0)
    stops = np.where(np.isnan(stops), np.where(rates > 0.0, high, low), stops)
    # a joint that begins beyond its limit stays where it is
    stops = np.where(rates > 0.0, np.maximum(stops, starts), np.minimum(stops, starts))
    return Chains(frame.astype(np.int32), joints.astype(np.int32), rates, stops, starts)


def _distinct(columns: Sequence[NDArray]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Unique rows of a table given by columns: index of the first of each, and for every row its unique number."""
    code = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        if (column != column[0]).any():
            values, place = np.unique(column, return_inverse=True)
            code = np.unique(code * len(values) + place, return_inverse=True)[1]
    _, first, number = np.unique(code, return_index=True, return_inverse=True)
    return first, number
