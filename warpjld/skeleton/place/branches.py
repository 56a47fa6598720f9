"""Branches of a voxel solid (limbs, digits) by persistence of the geodesic distance, and their centre lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.place.solid import VoxelSolid

__all__ = ["Branch", "centre_line", "find_branches", "point_at"]


@dataclass(frozen=True, eq=False)
class Branch:
    """A part of a solid that is connected beyond some geodesic distance from the start.

    Attributes:
        tip: Its furthest voxel.
        parting: Distance at which it joins a longer branch; 0 for the longest.
        voxels: Its own voxels, furthest first.
        length: From the parting to the tip.
    """

    tip: int
    parting: float
    voxels: NDArray[np.int64]
    length: float


def find_branches(solid: VoxelSolid, distance: NDArray[np.float64], least: float) -> list[Branch]:
    """Branches of at least the length ``least``, the longest first: peaks of the distance by their persistence.

    Voxels are added from the furthest inwards; a piece is born at a peak and ends where it meets a piece with a higher
    peak (Edelsbrunner, Letscher, Zomorodian 2002).
    """
    known = np.flatnonzero(np.isfinite(distance))
    order = known[np.argsort(-distance[known], kind="stable")]
    graph = (solid.graph + solid.graph.T).tocsr()
    starts, ends = graph.indptr.tolist(), graph.indices.tolist()
    owner = [-1] * len(distance)
    union_parent: list[int] = []
    peaks: list[int] = []
    own: list[list[int]] = []
    found: list[Branch] = []

    def find_root(piece: int) -> int:
        while union_parent[piece] != piece:
            union_parent[piece] = union_parent[union_parent[piece]]
            piece = union_parent[piece]
        return piece

    for voxel in order.tolist():
        around = {owner[other] for other in ends[starts[voxel] : starts[voxel + 1]]}
        around.discard(-1)
        pieces = {find_root(piece) for piece in around}
        if not pieces:
            union_parent.append(len(union_parent))
            peaks.append(voxel)
            own.append([])
            pieces = {union_parent[-1]}
        first = max(pieces, key=lambda p: distance[peaks[p]]) if len(pieces) > 1 else next(iter(pieces))
        for piece in pieces - {first}:
            length = float(distance[peaks[piece]] - distance[voxel])
            if length >= least:
                found.append(Branch(peaks[piece], float(distance[voxel]), np.array(own[piece]), length))
            union_parent[piece] = first
            own[first].extend(own[piece] if length < least else ())
        owner[voxel] = first
        own[first].append(voxel)
    if peaks:
        first = find_root(0)
        far = float(distance[peaks[first]])
        found.append(Branch(peaks[first], 0.0, np.array(own[first]), far))
    return sorted(found, key=lambda branch: -branch.length)


def centre_line(
    solid: VoxelSolid, voxels: NDArray[np.int64], from_tip: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres and cross-section areas of slices of a part of a solid, cut by distance from a tip.

    Args:
        solid: The solid.
        voxels: Indices of the voxels to slice.
        from_tip: Distance of every voxel of the solid from the tip.
        step: Thickness of a slice.

    Returns:
        Centres from the tip on, shape (n, 3), and areas, shape (n,).
    """
    slices = (from_tip[voxels] / step).astype(int)
    count = np.bincount(slices)
    sums = np.stack([np.bincount(slices, weights=solid.points[voxels, k]) for k in range(3)], axis=1)
    there = count > 0
    return sums[there] / count[there, None], np.asarray(count[there] * solid.size**3 / step, dtype=np.float64)


def point_at(line: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """The point of a polyline at arc length ``length`` from its start; extrapolated in a straight line past its end."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if length > along[-1]:
        k = max(0, int(np.searchsorted(along, 0.7 * along[-1])) - 1)
        direction = line[-1] - line[k]
        return np.asarray(line[-1] + (length - along[-1]) * direction / max(float(np.linalg.norm(direction)), 1e-30))
    return np.stack([np.interp(length, along, line[:, k]) for k in range(3)])
