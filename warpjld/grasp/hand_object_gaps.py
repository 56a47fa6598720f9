"""How deep hand and object are in one another, looked at from both sides, by part of the hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.kept import kept_with
from warpjld.grasp.moving_skin import share_moved
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.outline_points import outline_points
from warpjld.grasp.point_groups import grouped_points
from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["HandObjectGaps"]

_DEEPEST = 0.015  # of the object what lies deeper in the skin or farther from it is not measured [m]
_NEAR = 2e-3  # points this far from a hand's bounding box matter [m]
_SWELLS = 0.02  # share of a digit from which skin of the palm counts as moved by it


class HandObjectGaps:
    """Distances between poses of one hand and an object.

    A hand's vertices say how far skin is from the object, or how deep in it; the object's vertices and points of its
    sharp edges (see ``outline_points``) say how deep the object is in the skin, which the vertices of a coarse finger
    do not see.

    Args:
        covering: The hand.
        thing: The object.

    Attributes:
        parts: Names of the parts, e.g. ``left.index``, ``left.palm``.
        part_of_vertex: Number of every vertex's part, shape (V,).
    """

    def __init__(self, covering: Covering, thing: GraspObject) -> None:
        self.covering, self.thing, self.near = covering, thing, NearObject(thing)
        self._skins, self._points = kept_with(covering, PosedSkins), grouped_points(outline_points(thing))
        self.parts = self._skins.parts.names
        owned = kept_with(covering, _Owners)
        self.part_of_vertex, self._owners, self._movers = owned.owners[1], owned.owners, owned.movers
        self._all = np.arange(len(self.part_of_vertex), dtype=np.int32)

    def gaps(self, vertices: NDArray[np.floating], places: Places | None = None) -> NDArray[np.float64]:
        """Smallest signed distance by part [m], negative where something is inside, shape (P, parts).

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            places: Where the object is, once or for each; its own place if left out.
        """
        return self._least(vertices, places, np.inf, self._owners)

    def depths(
        self, vertices: NDArray[np.floating], places: Places | None = None, *, moved: bool = False
    ) -> NDArray[np.float64]:
        """Depth of the deepest point by part [m], 0 where none is, shape (P, parts); sooner found than ``gaps``.

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            places: Where the object is, once or for each; its own place if left out.
            moved: Count skin of the palm that swells when a digit bends as that digit's.
        """
        return -self._least(vertices, places, 0.0, self._movers if moved else self._owners)

    def depth_of_object(self, vertices: NDArray[np.floating]) -> float:
        """Depth of the object's deepest point in a deformed skin (V, 3) [m], 0 where none is, at its own place."""
        skins, gaps = self._skins.fitted(vertices[None], self.thing.place), np.zeros((1, len(self.parts)))
        self._skins.least_distances(skins, self._points, self._owners[0], gaps, near=_NEAR, limit=np.inf, outside=False)
        return -float(gaps.min())

    def _least(
        self,
        vertices: NDArray[np.floating],
        places: Places | None,
        most: float,
        owners: tuple[NDArray[np.int32], NDArray[np.int32]],
    ) -> NDArray[np.float64]:
        """Smallest signed distances by part where they are below ``most``, else that."""
        of_face, of_vertex = owners
        where = self.thing.place if places is None else places
        where = where[np.zeros(len(vertices), dtype=int)] if len(where) == 1 else where
        gaps, together = np.full((len(vertices), len(self.parts)), most), self._skins.most
        for first in range(0, len(vertices), together):
            rows = slice(first, min(first + together, len(vertices)))
            skins, found = self._skins.fitted(vertices[rows], where[rows]), gaps[rows]
            self.near.least_by_part(skins.points, self._all, of_vertex, found)
            self._skins.least_distances(
                skins, self._points, of_face, found, near=_NEAR, limit=_DEEPEST, outside=most > 0.0
            )
        return gaps


class _Owners:
    """Parts that faces (T,) and vertices (V,) count as: their own, or that of the digit that moves them."""

    def __init__(self, covering: Covering) -> None:
        parts, faces = kept_with(covering, PosedSkins).parts, covering.surface.faces
        of_vertex = np.zeros(len(covering.surface.vertices), dtype=np.int32)
        of_vertex[faces.ravel()] = np.repeat(parts.of_face, 3)
        chains = {name: chain for name, chain in digit_chains(covering.skeleton).items() if name in parts.names}
        numbers = np.array([parts.names.index(name) for name in chains], dtype=np.int32)
        share = np.stack([share_moved(covering, chain[0]) for chain in chains.values()])
        of_digit = np.isin(of_vertex, numbers)
        movers = np.where(~of_digit & (share.max(axis=0) > _SWELLS), numbers[share.argmax(axis=0)], of_vertex)
        most = np.take_along_axis(faces, share.max(axis=0)[faces].argmax(axis=1)[:, None], axis=1)[:, 0]
        self.owners = parts.of_face, of_vertex
        self.movers = np.where(np.isin(parts.of_face, numbers), parts.of_face, movers[most]), movers
