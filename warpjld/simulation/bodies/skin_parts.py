"""Digits and palm of a visible skin as closed surfaces, for overlap tests between them (R126, R127)."""

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
    """Skin of one digit or of the palm.

    Attributes:
        name: ``thumb``, …, ``palm``.
        vertices: Its vertices, as indices into the skin, shape (v,).
        faces: Triangles of the closed part, shape (t, 3); indices beyond the skin's vertices are the centres of the
            boundary loops, which close it.
        loops: Vertices of each boundary loop.
    """

    name: str
    vertices: NDArray[np.int64]
    faces: NDArray[np.int32]
    loops: tuple[NDArray[np.int32], ...]

    def surface(self, at: NDArray[np.float64]) -> Facets:
        """The closed surface for skin vertices (V, 3) [m]."""
        middles = [at[loop].mean(axis=0, keepdims=True) for loop in self.loops]
        return Facets(np.concatenate([at, *middles]), self.faces)


@dataclass(frozen=True, eq=False)
class SkinParts:
    """Partition of a skin into digits and palm.

    Attributes:
        labels: Label (bone segment) of each vertex, shape (V,).
        never: Pairs of labels that are not tested: neighbours, and labels that touch at rest, shape (L, L).
        part_of: Part of every label, an index into ``names``, shape (L,).
        names: Names of the parts.
        faces: Triangles of the skin, shape (T, 3).
    """

    labels: NDArray[np.int32]
    never: NDArray[np.bool_]
    part_of: NDArray[np.int32]
    names: tuple[str, ...]
    faces: NDArray[np.int32]

    @cached_property
    def parts(self) -> tuple[SkinPart, ...]:
        """All parts that have faces."""
        part = self.part_of[self.labels]
        of_face = part[self.faces].max(axis=1)  # faces between two parts go to the last one: the palm, if it is one
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
        """Mask of the vertices of a part, shape (V,)."""
        return np.asarray(self.part_of[self.labels] == self.names.index(name))

    def name_of(self, vertices: NDArray[np.integer]) -> list[str]:
        """Names of the parts that vertices belong to, by descending number of vertices."""
        count = np.bincount(self.part_of[self.labels[vertices]], minlength=len(self.names))
        return [self.names[k] for k in np.argsort(-count, kind="stable") if count[k]]

    def meet(self, vertices: NDArray[np.integer], corner: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Whether contact between vertices and given corners of facets is possible; never with the centre of a loop."""
        real = corner < len(self.labels)
        other = self.labels[np.where(real, corner, 0)]
        return np.asarray(real & ~self.never[self.labels[vertices], other])


def skin_parts(hand: FleshHand) -> SkinParts:
    """Partition of the skin of a whole hand at the rig's rest, where digits are apart."""
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
    """Boundary loops of a triangulation as vertex sequences, oriented as in the triangles."""
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
    """Triangle fan that closes a loop around a central vertex, shape (n, 3)."""
    return np.stack([np.roll(loop, -1), loop, np.full(len(loop), middle)], axis=1).astype(np.int32)
