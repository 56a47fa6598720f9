"""How deep hand and object are in one another, looked at from both sides, by part of the hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.intersections import surface_parts
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.moved import share_moved
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.outline import outline
from warpjld.grasp.validation import MeshReport

__all__ = ["BothWays", "give_way"]

_DEEPEST = 0.015  # of the object what lies deeper in the skin or farther from it is not measured [m]
_NEAR = 2e-3  # points this far from a hand's bounding box matter [m]
_WAY = (0.25, 0.5, 0.75, 0.9)  # parts of the way at which digits must not be in the object
_SWELLS = 0.02  # share of a digit from which skin of the palm counts as moved by it
_HALVINGS = 7


class BothWays:
    """Distances between poses of one hand and an object.

    A hand's vertices say how far skin is from the object, or how deep in it; the object's vertices and points of its
    sharp edges (see ``outline``) say how deep the object is in the skin, which the vertices of a coarse finger do not
    see.

    Args:
        covering: The hand.
        thing: The object.

    Attributes:
        parts: Names of the parts, e.g. ``left.index``, ``left.palm``.
        part_of_vertex: Number of every vertex's part, shape (V,).
    """

    def __init__(self, covering: Covering, thing: GraspObject) -> None:
        self.covering, self.thing = covering, thing
        self._objects, self._points = ObjectSet(thing.placed()), outline(thing)
        parts = surface_parts(covering)
        self.parts = parts.names
        faces = covering.surface.faces
        of_vertex = np.zeros(len(covering.surface.vertices), dtype=np.int32)
        of_vertex[faces.ravel()] = np.repeat(parts.of_face, 3)
        self.part_of_vertex, self._owners = of_vertex, (parts.of_face, of_vertex)
        chains = {name: chain for name, chain in digit_chains(covering.skeleton).items() if name in parts.names}
        numbers = np.array([parts.names.index(name) for name in chains], dtype=np.int32)
        share = np.stack([share_moved(covering, chain[0]) for chain in chains.values()])
        of_digit = np.isin(of_vertex, numbers)
        movers = np.where(~of_digit & (share.max(axis=0) > _SWELLS), numbers[share.argmax(axis=0)], of_vertex)
        most = np.take_along_axis(faces, share.max(axis=0)[faces].argmax(axis=1)[:, None], axis=1)[:, 0]
        self._movers = np.where(np.isin(parts.of_face, numbers), parts.of_face, movers[most]), movers

    def gaps(
        self, vertices: NDArray[np.floating], place: Places | None = None, *, moved: bool = False
    ) -> NDArray[np.float64]:
        """Smallest signed distance by part [m], negative where something is inside, shape (parts,).

        Args:
            vertices: A deformed skin [m], shape (V, 3).
            place: Where the object is; its own place if left out.
            moved: Count skin of the palm that swells when a digit bends as that digit's.
        """
        of_face, of_vertex = self._movers if moved else self._owners
        vertices = (place or self.thing.place).to_local(vertices)[0]
        gaps = np.full(len(self.parts), np.inf)
        np.minimum.at(gaps, of_vertex, self._objects.distances(vertices).distance[0])
        low, high = vertices.min(axis=0) - _NEAR, vertices.max(axis=0) + _NEAR
        near = self._points[((self._points >= low) & (self._points <= high)).all(axis=1)]
        if len(near):
            # hands are open at the wrist: winding numbers tell inside from outside
            report = MeshReport(open_edges=1, solid=False)
            body = GraspObject("skin", np.asarray(vertices, np.float64), self.covering.surface.faces, report)
            found = ObjectSet(body).distances(near, limit=_DEEPEST)
            some = found.face[0] >= 0
            np.minimum.at(gaps, of_face[found.face[0, some]], found.distance[0, some])
        return gaps

    def depths(self, vertices: NDArray[np.floating], place: Places | None = None) -> NDArray[np.float64]:
        """Depth of the deepest point by part [m], 0 where none is, shape (parts,)."""
        return np.maximum(0.0, -self.gaps(vertices, place))


def give_way(
    gaps: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    parts: Sequence[str],
    start: NDArray[np.float64],
    closed: NDArray[np.float64],
    chains: Mapping[str, tuple[int, ...]],
    *,
    allowed: float,
    on_the_way: float,
) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Open digits that the object cuts into, as far as they must and no farther than they began.

    All joints go their way together. A digit is stopped where its depth at the end is allowed, and before the first
    place on the way at which it would pass through the object.

    Args:
        gaps: Of one hand with joint angles (J, 4), by part [m], see ``BothWays.gaps``.
        parts: Names of these parts.
        start: Angles of the open hand [rad], shape (J, 4).
        closed: Angles of the closed hand [rad], shape (J, 4).
        chains: Joints of the digits, see ``digit_chains``.
        allowed: Depth that stays at the end [m].
        on_the_way: Depth above which a digit passes through the object [m].

    Returns:
        Angles, shape (J, 4), and the part of their way that digits went which opened.
    """
    digits = [digit for digit in chains if digit in parts]
    rows = [parts.index(digit) for digit in digits]
    joints = [list(chains[digit]) for digit in digits]

    def angles_at(way: NDArray[np.float64]) -> NDArray[np.float64]:
        out = start.copy()
        for own, part in zip(joints, way, strict=True):
            out[own] = start[own] + part * (closed[own] - start[own])
        return out

    high = np.ones(len(digits))
    for part in _WAY:
        passing = gaps(angles_at(part * np.ones(len(digits))))[rows] < -on_the_way
        high = np.where(passing, np.minimum(high, part), high)
    cut = gaps(angles_at(high))[rows] < -allowed
    if not cut.any():
        return angles_at(high), {digit: float(high[k]) for k, digit in enumerate(digits) if high[k] < 1.0}
    low = np.where(cut, 0.0, high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        deep = gaps(angles_at(middle))[rows] < -allowed
        low, high = np.where(deep, low, middle), np.where(deep, middle, high)
    return angles_at(low), {digit: float(low[k]) for k, digit in enumerate(digits) if low[k] < 1.0}
