"""Gaps and penetration depths of a hand and an object by part of the hand, measured in both directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.moving_skin import share_moved
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["HandObjectGaps"]

_DEEPEST = 0.015  # points of the object deeper in the skin, or farther from it, are ignored [m]
_NEAR = 2e-3  # points of the object farther from the hand's bounding box are ignored [m]
_SWELLS = 0.02  # weight of a digit's operators above which skin of the palm counts as moved by that digit


class HandObjectGaps:
    """Distances between poses of one hand and an object.

    Measured in both directions: from the hand's vertices to the object, and from the object's vertices and points on
    its sharp edges (see ``outline_points``) to the skin. The second finds edges that enter the skin between its
    vertices.

    Args:
        covering: The hand.
        thing: The object.
        near: Search structures of the object, if there are some already.
        device: Warp device of new ones, on which distances to the object are measured. Distances to the skin are
            measured on the CPU.

    Attributes:
        parts: Names of the parts, e.g. ``left.index``, ``left.palm``.
        part_of_vertex: Number of every vertex's part, shape (V,).
    """

    def __init__(
        self, covering: Covering, thing: GraspObject, near: NearObject | None = None, device: str = "cpu"
    ) -> None:
        self.covering, self.thing, self.near = covering, thing, near or NearObject(thing, device)
        self._skins = kept_with(covering, PosedSkins)
        self.parts = self._skins.parts.names
        owned = kept_with(covering, _Owners)
        self.part_of_vertex, self._owners, self._movers = owned.owners[1], owned.owners, owned.movers
        self._all = np.arange(len(self.part_of_vertex), dtype=np.int32)

    def gaps(self, vertices: NDArray[np.floating], places: Places | None = None) -> NDArray[np.float64]:
        """Smallest signed distance by part [m], negative where something is inside, shape (P, parts).

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            places: Placement of the object, one for all or one for each; its own if left out.
        """
        return self._least(vertices, places, np.inf, self._owners)

    def depths(
        self, vertices: NDArray[np.floating], places: Places | None = None, *, moved: bool = False
    ) -> NDArray[np.float64]:
        """Penetration depth by part [m], 0 where nothing is inside, shape (P, parts); faster than ``gaps``.

        Args:
            vertices: Deformed skins [m], shape (P, V, 3).
            places: Placement of the object, one for all or one for each; its own if left out.
            moved: Attribute skin of the palm that a digit moves (it swells as the digit flexes) to that digit.
        """
        return -self._least(vertices, places, 0.0, self._movers if moved else self._owners)

    def depth_of_object(self, vertices: NDArray[np.floating]) -> float:
        """Depth of the object's deepest point in a deformed skin (V, 3) [m], 0 where none is inside."""
        skins, gaps = self._skins.fitted(vertices[None], self.thing.place), np.zeros((1, len(self.parts)))
        points, owners = self.near.outline, self._owners[0]
        self._skins.least_distances(skins, points, owners, gaps, near=_NEAR, limit=np.inf, outside=False)
        return -float(gaps.min())

    def _least(
        self,
        vertices: NDArray[np.floating],
        places: Places | None,
        most: float,
        owners: tuple[NDArray[np.int32], NDArray[np.int32]],
    ) -> NDArray[np.float64]:
        """Smallest signed distances by part, clipped from above at ``most``."""
        of_face, of_vertex = owners
        where = self.thing.place if places is None else places
        where = where[np.zeros(len(vertices), dtype=int)] if len(where) == 1 else where
        gaps, together = np.full((len(vertices), len(self.parts)), most), self._skins.most
        for first in range(0, len(vertices), together):
            rows = slice(first, min(first + together, len(vertices)))
            skins, found = self._skins.fitted(vertices[rows], where[rows]), gaps[rows]
            self.near.least_by_part(skins.points, self._all, of_vertex, found)
            self._skins.least_distances(
                skins, self.near.outline, of_face, found, near=_NEAR, limit=_DEEPEST, outside=most > 0.0
            )
        return gaps


class _Owners:
    """Part of every face (T,) and vertex (V,): the one they belong to (``owners``), and the one that moves them.

    The latter (``movers``) differ for skin of the palm that a digit moves.
    """

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
