"""Proposal of named points in any surface, a body's 87 or a hand's 25, all of them inside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.inside_out import is_inside_out
from warpjld.skeleton.place.body import place_body
from warpjld.skeleton.place.hand import place_hand
from warpjld.skeleton.place.solid import VoxelSolid, solid_of
from warpjld.skeleton.recognise.hand_frame import chirality
from warpjld.skeleton.recognise.placing.inside import outside_surface

__all__ = ["propose_points"]

Array = NDArray[np.float64]

_GRID = 170  # voxels in a hand's diagonal
_CLEAR = 0.15  # smallest absolute chirality that decides a hand's side
_CANDIDATES = 4000  # nearest voxels tried for a point that lies outside


def propose_points(
    vertices: Array, faces: NDArray[np.integer], *, side: str | None = None, label: str = "the surface"
) -> dict[str, Array]:
    """Propose the named points of an actor in a digitised surface, to be corrected by hand (B §2.1).

    Args:
        vertices: Surface in any unit and axes, shape (V, 3); a body stands upright along an axis.
        faces: Its triangles, shape (T, 3).
        side: ``left`` or ``right`` if the surface is that hand; otherwise a body is tried first, then a hand.
        label: Name of the surface in messages.

    Returns:
        87 points of a body or 25 of a hand by name [the surface's unit and axes], each shape (3,).

    Raises:
        InputError: It is neither, or its legs, arms or fingers are not apart from one another.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> points = wj.propose_points(hand.surface.vertices, hand.surface.faces)
        >>> len(points), points["left.index.tip"].shape
        (25, (3,))
    """
    used = np.unique(faces)
    number = np.full(len(vertices), -1)
    number[used] = np.arange(len(used))
    vertices, faces = np.asarray(vertices, dtype=np.float64)[used], number[faces]
    if not len(faces) or not np.ptp(vertices, axis=0).max() > 0.0:
        raise InputError(f"{label}: has no triangles, or no extent")
    if is_inside_out(vertices, faces):
        faces = faces[:, ::-1]
    if side is not None:
        return _hand(vertices, faces, side, label)
    try:
        return _moved_inside(place_body(vertices, faces, label), vertices, faces, None)
    except InputError as error:
        no_body = error
    try:
        return _hand(vertices, faces, None, label)
    except InputError as error:
        raise InputError(f"{no_body.message}; and no hand: {error.message.removeprefix(f'{label}: ')}") from None


def _hand(vertices: Array, faces: NDArray[np.integer], side: str | None, label: str) -> dict[str, Array]:
    size = float(np.linalg.norm(np.ptp(vertices, axis=0))) / _GRID
    solid = solid_of(vertices, faces, size).main_piece()
    points = place_hand(solid, label=label)
    turn = chirality(points)
    if side is None and abs(turn) < _CLEAR:
        raise InputError(f"{label}: cannot tell by fingers and thumb whether it is a left or a right hand: give --side")
    side = side or ("right" if turn > 0 else "left")
    points = {f"{side}.{name}": points[name] for name in _in_canonical_order(points)}
    return _moved_inside(points, vertices, faces, solid)


def _in_canonical_order(points: dict[str, Array]) -> list[str]:
    from warpjld.skeleton.hand import HAND_PARENTS

    return [name for name in HAND_PARENTS if name in points]


def _moved_inside(
    points: dict[str, Array], vertices: Array, faces: NDArray[np.integer], solid: VoxelSolid | None
) -> dict[str, Array]:
    """Move points that lie outside the surface (in a cavity such as a mouth) to the nearest place in the flesh."""
    names = list(points)
    out = np.flatnonzero(outside_surface(vertices, faces, np.array(list(points.values()))))
    if not len(out):
        return points
    if solid is None:
        solid = solid_of(vertices, faces, float(np.ptp(vertices, axis=0).max()) / _GRID)
    for j in out:
        away = np.linalg.norm(solid.points - points[names[j]], axis=1)
        near = np.argsort(away)[:_CANDIDATES:8]
        inside = near[~outside_surface(vertices, faces, solid.points[near])]
        if len(inside):
            points[names[j]] = solid.points[inside[0]]
    return points
