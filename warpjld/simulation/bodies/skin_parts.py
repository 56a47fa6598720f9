"""Digits and palm of a visible skin, each as a closed surface, to see where they overlap (R126, R127)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.skeleton import DIGITS

__all__ = ["SkinPart", "SkinParts", "digit_of_label", "skin_parts"]


@dataclass(frozen=True, eq=False)
class SkinPart:
    """One digit, or the palm.

    Attributes:
        name: ``thumb``, …, ``palm``.
        vertices: Its own, shape (v,).
        faces: Triangles over the vertices of the skin and, beyond them, the middles of the loops that it ends at,
            shape (t, 3).
        loops: Vertices of each of these loops.
    """

    name: str
    vertices: NDArray[np.int64]
    faces: NDArray[np.int32]
    loops: tuple[NDArray[np.int32], ...]

    def surface(self, at: NDArray[np.float64]) -> Facets:
        """It, closed, with the skin's vertices there (V, 3) [m]."""
        middles = [at[loop].mean(axis=0, keepdims=True) for loop in self.loops]
        return Facets(np.concatenate([at, *middles]), self.faces)


@dataclass(frozen=True, eq=False)
class SkinParts:
    """All parts of a skin.

    Attributes:
        labels: What part of the skin a vertex belongs to, shape (V,).
        never: Pairs of labels that do not meet: neighbours, and what touches at rest, shape (L, L).
        part_of: Part of every label: an index into ``names``, shape (L,).
        names: Of the parts.
        faces: Triangles of the skin, shape (T, 3).
    """

    labels: NDArray[np.int32]
    never: NDArray[np.bool_]
    part_of: NDArray[np.int32]
    names: tuple[str, ...]
    faces: NDArray[np.int32]

    @cached_property
    def parts(self) -> tuple[SkinPart, ...]:
        """Those that there are."""
        part = self.part_of[self.labels]
        of_face = part[self.faces].max(axis=1)  # the palm is last: it takes the faces between
        out = []
        for number, name in enumerate(self.names):
            mine = np.flatnonzero(part == number)
            faces = self.faces[of_face == number]
            if len(mine) and len(faces):
                loops = _loops(faces)
                caps = [_cap(loop, len(self.labels) + k) for k, loop in enumerate(loops)]
                out.append(SkinPart(name, mine, np.concatenate([faces, *caps]).astype(np.int32), tuple(loops)))
        return tuple(out)

    def mask(self, name: str) -> NDArray[np.bool_]:
        """Vertices of a part, shape (V,)."""
        return np.asarray(self.part_of[self.labels] == self.names.index(name))

    def name_of(self, vertices: NDArray[np.integer]) -> list[str]:
        """Names of the parts that vertices belong to, the largest share first."""
        count = np.bincount(self.part_of[self.labels[vertices]], minlength=len(self.names))
        return [self.names[k] for k in np.argsort(-count, kind="stable") if count[k]]

    def meet(self, vertices: NDArray[np.integer], corner: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Whether vertices may meet the skin that other vertices belong to; nothing meets the middle of a loop."""
        real = corner < len(self.labels)
        other = self.labels[np.where(real, corner, 0)]
        return np.asarray(real & ~self.never[self.labels[vertices], other])


def skin_parts(hand: FleshHand) -> SkinParts:
    """Parts of the skin of a whole hand as it is built: at the rig's rest, where digits are apart."""
    from scipy.spatial import cKDTree

    middle = hand.mesh.nodes[hand.mesh.quads(hand.skin_faces)].mean(axis=1)
    labels = hand.skin_labels[cKDTree(middle).query(hand.surface.vertices)[1]]
    names = (*DIGITS, "palm")
    part_of = np.array([names.index(digit_of_label(name)) for name in hand.label_names], np.int32)
    return SkinParts(labels, hand.excluded, part_of, names, hand.surface.faces)


def digit_of_label(label: str) -> str:
    """Digit of a label of the skin, or the palm: ``left.index.distal`` → ``index``; ``left.palm.index`` → ``palm``."""
    words = label.split(".")
    found = [word for word in words if word in DIGITS]
    return found[0] if found and "palm" not in words else "palm"


def _loops(faces: NDArray[np.int32]) -> list[NDArray[np.int32]]:
    """Vertices along the open edges of triangles, loop by loop, in the direction of the triangles."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, times = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    following = {int(a): int(b) for a, b in edges[first[times == 1]]}
    out = []
    while following:
        start, at = next(iter(following.items()))
        loop = [start]
        del following[start]
        while at != start and at in following:
            loop.append(at)
            at = following.pop(at)
        out.append(np.array(loop, np.int32))
    return out


def _cap(loop: NDArray[np.int32], middle: int) -> NDArray[np.int32]:
    """Triangles that close a loop around a vertex in its middle."""
    return np.stack([np.roll(loop, -1), loop, np.full(len(loop), middle)], axis=1).astype(np.int32)
