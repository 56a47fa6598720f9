"""Intersection of a hand and an object: vertices inside, depths and common volume (A §7.2, R75); parts in contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.posed_skins import PosedSkins
from warpjld.skeleton.segments import SEGMENT_JOINTS, segment_joints
from warpjld.suggest import did_you_mean

__all__ = ["Contact", "Intersection", "contacts", "intersection", "intersection_beside", "part_vertices"]

_CELLS = 48  # cells of the volume's grid along the longest side of the overlap
_BLOCK = 4  # points of the grid along a block's side
_FINEST = 2e-4  # smallest edge of these cells [m]


@dataclass(frozen=True, eq=False)
class Intersection:
    """The vertices of a part that lie inside an object, and the common volume.

    Attributes:
        vertices: Indices of the surface's vertices inside, shape (n,); ``surface.numbers`` has the file's own.
        depths: Their depths [m], positive, shape (n,).
        volume: Common volume [m³]: the midpoint rule on a grid over the overlap, cells at either surface counted by
            the share that a plane at their signed distance cuts off, Σ h³ c(d_hand) c(d_object) with
            c(d) = clamp(½ − d / h, 0, 1).
        spacing: The grid's h [m]; 0 where no vertex of one lies inside the other, and the volume counts as 0.
    """

    vertices: NDArray[np.int32]
    depths: NDArray[np.float64]
    volume: float
    spacing: float

    @property
    def deepest(self) -> float:
        """Largest depth [m]; 0 where nothing is inside."""
        return float(self.depths.max(initial=0.0))

    def __str__(self) -> str:
        if not len(self.vertices):
            return "no vertex inside"
        return (
            f"{len(self.vertices)} vertices inside, deepest {1e3 * self.deepest:.2f} mm, "
            f"volume {1e9 * self.volume:.0f} mm³ (grid of {1e3 * self.spacing:.2f} mm)"
        )


@dataclass(frozen=True)
class Contact:
    """Contact of one part of a hand with an object.

    Attributes:
        part: Name of the part, e.g. ``left.index``, ``left.palm``.
        vertices: Number of vertices nearer than the tolerance, those inside included; 0 where an edge of the object
            touches between them.
        deepest: Largest penetration depth [m], measured in both directions; 0 where there is none.
        nearest: Smallest signed distance [m], likewise.
    """

    part: str
    vertices: int
    deepest: float
    nearest: float


def part_vertices(covering: Covering, part: str | None) -> NDArray[np.int32]:
    """Indices of the vertices of a part of the surface.

    ``index.knuckle2`` is the segment that begins at that joint, ``index`` a digit, ``palm`` the palm, ``left.forearm``
    what anatomy calls so (:func:`~warpjld.skeleton.segments.segment_joints`), None everything.

    Raises:
        InputError: There is no such part; suggests the nearest.
    """
    if part is None:
        return np.arange(len(covering.surface.vertices), dtype=np.int32)
    wanted = part.lower()
    owner = covering.domains.argmax(axis=1)
    short = [_without_side(fan.name) for fan in covering.fans]
    chosen = [
        k
        for k, fan in enumerate(covering.fans)
        if wanted in (fan.name, short[k]) or fan.name.startswith(f"{wanted}.") or short[k].startswith(f"{wanted}.")
    ]
    word = wanted.rpartition(".")[2]
    if not chosen and word in SEGMENT_JOINTS:
        joints = {covering.skeleton.names[joint] for joint in segment_joints(covering.skeleton, wanted)}
        chosen = [k for k, fan in enumerate(covering.fans) if fan.name in joints]
    if not chosen:
        known = {*(fan.name for fan in covering.fans), *short, *(name.partition(".")[0] for name in short)}
        raise InputError(f"no part '{part}' in this surface{did_you_mean(wanted, sorted(known))}")
    return np.flatnonzero(np.isin(owner, chosen)).astype(np.int32)


def intersection(
    covering: Covering,
    vertices: NDArray[np.floating],
    thing: GraspObject,
    *,
    place: Places | None = None,
    part: str | None = None,
    spacing: float | None = None,
) -> Intersection:
    """Intersection process (A §7.2): the distance of every vertex of a part to an object.

    Args:
        covering: The hand's covering, which defines parts and faces.
        vertices: The deformed surface [m], shape (V, 3).
        thing: The object.
        place: One placement; the object's own if left out.
        part: Segment or digit, see :func:`part_vertices`; everything if left out.
        spacing: Edge of the volume's grid cells [m]; by default 1/48 of the overlap's longest side, at least 0.2 mm.

    Raises:
        InputError: No such part, or a surface of another size.
    """
    if vertices.shape != (len(covering.surface.vertices), 3):
        raise InputError(f"vertices: want shape {(len(covering.surface.vertices), 3)}, got {vertices.shape}")
    where = thing.place if place is None else place
    return intersection_beside(covering, where.to_local(vertices)[0], NearObject(thing), part=part, spacing=spacing)


def intersection_beside(
    covering: Covering,
    local: NDArray[np.float64],
    near: NearObject,
    *,
    part: str | None = None,
    spacing: float | None = None,
) -> Intersection:
    """``intersection`` of a surface (V, 3) in the object's frame [m], with search structures made before."""
    chosen = part_vertices(covering, part)
    distance = near.near(local[chosen], 0.0).distance.astype(np.float64)
    inside = distance < 0.0
    volume, h = _common_volume(covering, local, near, chosen, inside, spacing)
    return Intersection(chosen[inside], -distance[inside], volume, h)


def contacts(
    covering: Covering,
    vertices: NDArray[np.floating],
    thing: GraspObject,
    *,
    place: Places | None = None,
    tolerance: float = 5e-4,
) -> list[Contact]:
    """Parts of a deformed surface (V, 3) that are nearer to an object than ``tolerance`` [m]."""
    from warpjld.grasp.hand_object_gaps import HandObjectGaps

    where = thing.place if place is None else place
    both = HandObjectGaps(covering, thing)
    (gaps,) = both.gaps(vertices[None], where)
    close = both.near.near(where.to_local(vertices)[0], tolerance).distance < tolerance
    counts = np.bincount(both.part_of_vertex[close], minlength=len(gaps))
    return [
        Contact(name, int(count), max(0.0, -float(gap)), float(gap))
        for name, count, gap in zip(both.parts, counts, gaps, strict=True)
        if gap < tolerance
    ]


def _common_volume(
    covering: Covering,
    local: NDArray[np.float64],
    near: NearObject,
    chosen: NDArray[np.int32],
    inside: NDArray[np.bool_],
    spacing: float | None,
) -> tuple[float, float]:
    posed = kept_with(covering, PosedSkins)
    skin = posed.fitted(local[None], Places.of())
    corners = near.thing.vertices
    within = ((corners >= local.min(axis=0)) & (corners <= local.max(axis=0))).all(axis=1)
    swallowed = posed.distances(skin, corners[within], _FINEST)[0] < 0.0
    seen = np.concatenate([local[chosen][inside], corners[within][swallowed]])
    if not len(seen):
        return 0.0, 0.0
    low, high = seen.min(axis=0), seen.max(axis=0)
    h = spacing or max(_FINEST, float((high - low).max()) / _CELLS)
    low, high = low - 2.0 * h, high + 2.0 * h
    axes = [np.arange(a + h / 2.0, b, h) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[_overlap(posed, skin, near, axes, h)]
    part = len(chosen) < len(local)  # the volume of a part: grid cells whose nearest triangle belongs to it
    # less of the grid lies in the skin than in the object, and a distance to the object takes longer
    to_skin, face = posed.distances(skin, points, np.inf if part else h)
    share = np.clip(0.5 - to_skin / h, 0.0, 1.0)
    kept = share > 0.0
    points, share, face = points[kept], share[kept], face[kept]
    share = share * np.clip(0.5 - near.near(points, h).distance.astype(np.float64) / h, 0.0, 1.0)
    if part:
        own = np.isin(covering.surface.faces, chosen).sum(axis=1) >= 2
        share = share * np.where(face < len(own), own[np.minimum(face, len(own) - 1)], False)
    return float(share.sum(dtype=np.float64) * h**3), h


def _overlap(
    posed: PosedSkins, skin: Any, near: NearObject, axes: list[NDArray[np.float64]], h: float
) -> NDArray[np.bool_]:
    """Mask of the points of a grid that may be within h of both a skin and an object, by blocks of points."""
    firsts = [axis[::_BLOCK] for axis in axes]
    middles = np.stack(np.meshgrid(*firsts, indexing="ij"), axis=-1) + (_BLOCK - 1) * h / 2.0
    # no point of a block is farther from its middle, and signed distances of closed surfaces change by no more
    limit = float(np.sqrt(3.0)) * (_BLOCK - 1) * h / 2.0 + 1.1 * h
    kept = posed.distances(skin, middles.reshape(-1, 3), limit)[0] <= limit
    if near.thing.report.solid:
        kept[kept] = near.near(middles.reshape(-1, 3)[kept], limit).distance <= limit
    blocks = kept.reshape(middles.shape[:-1])
    for k, axis in enumerate(axes):
        blocks = np.repeat(blocks, _BLOCK, axis=k).take(np.arange(len(axis)), axis=k)
    return blocks


def _without_side(name: str) -> str:
    side, _, rest = name.partition(".")
    return rest if side in ("left", "right") else name
